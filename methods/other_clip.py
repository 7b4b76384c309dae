"""Control: the right answer to another clip, blind to the source."""

import numpy as np

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character


class OtherClip(Method):
    """A plausible motion of the right body that has nothing to do with the source.

    The clip is chosen by the case's seed, brought to the source's rate, and cropped or played to and fro
    until the frame count fits. Whoever scores no better has not looked at the source.
    """

    card = MethodCard(
        name="other_clip",
        title="shuffled reference",
        summary="Control: the right answer to another clip, which does not follow the source",
        version="1",
        accepts=("motion", "positions", "points"),
        needs=("other_clips",),
        control=True,
        stochastic=True,
    )

    def supports(self, source: Character, target: Character) -> str | None:
        return None

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Prediction:
        clips = context.other_clips
        if not clips:
            raise NotSupported(f"{target.name} has no other clip to take")
        clip = clips[context.seed % len(clips)]
        if clip.fps != source.fps:
            clip = clip.resample(source.fps)
        return clip.at(to_and_fro(clip.frames, source.frames))


def to_and_fro(length: int, frames: int) -> np.ndarray:
    """``(frames,)`` frame numbers 0, 1 .. length - 1, length - 2 .. 1, 0, 1 .. as long as needed."""
    if length == 1:
        return np.zeros(frames, dtype=int)
    at = np.arange(frames) % (2 * length - 2)
    return np.minimum(at, 2 * length - 2 - at)


plugin = OtherClip
