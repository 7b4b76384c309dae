"""Averages rotations and the root path over time, against the trembling of networks."""

from retarget_bench.api import Context, Prediction
from retarget_bench.errors import BenchError
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.planting.cuts import takes
from retarget_bench.motion.smoothing import averaged
from retarget_bench.plugins.post_processors import Post, PostCard


class Smooth(Post):
    """A low-pass filter: moving averages with Gaussian weights, not over the source's cuts.

    Quaternions of one joint get signs that do not change from frame to frame, are averaged as vectors and
    made unit again: the chordal mean of the rotations, or near it. Beyond its ends a clip goes on as its
    mirror image through the end points, so that steady motion stays as it is.
    """

    card = PostCard(
        name="smooth",
        summary="Averages rotations and the root path over time with Gaussian weights",
        version="1",
        parameters={"sigma": "standard deviation of the weights in seconds"},
    )

    def __init__(self, sigma: float = 0.04) -> None:
        if not 0.0 <= sigma <= 10.0:
            raise BenchError(f"smooth: sigma is in seconds, from 0 to 10; got {sigma:g}")
        self.sigma = sigma

    def supports(self, source: Character, target: Character) -> str | None:
        return None

    def process(self, prediction: Prediction, source: Prediction, *, context: Context) -> Motion:
        assert isinstance(prediction, Motion)
        width = self.sigma * prediction.fps
        moved = prediction.copy()
        for piece in takes(source):
            mean = averaged(rotation.continuous(prediction.rotations[piece]), width)
            moved.rotations[piece] = rotation.normalise(mean)
            moved.root[piece] = averaged(prediction.root[piece], width)
        return moved


plugin = Smooth
