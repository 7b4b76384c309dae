"""One line that says what the post-processor does; bench list shows it."""

import numpy as np

from retarget_bench.api import Context, Prediction
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins.post_processors import Post, PostCard


class MyPost(Post):
    """Smooths the root's path over a few frames."""

    card = PostCard(
        name="my_post",
        summary="The root's path averaged over a few frames",
        version="1",
        parameters={"reach": "how many frames before and after each count"},
    )

    def __init__(self, reach: int = 2) -> None:
        self.reach = reach

    def supports(self, source: Character, target: Character) -> str | None:
        """None where answers of this pair can be worked on, else the reason why not."""
        del source, target
        return None

    def process(self, prediction: Prediction, source: Prediction, *, context: Context) -> Prediction:
        """Another motion of prediction.character: as many frames, at the same rate.

        prediction is what the method, or the post-processor before this one, gave: a Motion, or Positions
        where the card accepts them too. source is what the method was given. context.ground is the floor,
        or None; context.seed is the only randomness that may be used.
        """
        del source, context
        assert isinstance(prediction, Motion)  # all that the card accepts
        frames = np.arange(prediction.frames)[:, None] + np.arange(-self.reach, self.reach + 1)
        root = prediction.root[np.clip(frames, 0, prediction.frames - 1)].mean(axis=1)
        return prediction.character.motion(prediction.rotations, root, prediction.fps)


plugin = MyPost
