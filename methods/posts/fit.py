"""Fits rotations to answers that are known by joint positions; bones get the body's lengths."""

from retarget_bench.api import Context, Prediction
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.fitting import fit
from retarget_bench.plugins.post_processors import Post, PostCard


class Fit(Post):
    """The motion of the body that comes nearest to the positions of an answer, all joints together.

    A method that gives positions can so be scored by metrics of rotations, with bones that do not stretch.
    The fit is that of ``bench retarget``: twists that no position shows come from the hinges of knees and
    elbows, from the source's rotations or else from the reference pose, and are smooth. They are not the
    method's. An answer that has rotations is left as it is.
    """

    card = PostCard(
        name="fit",
        summary="Fits rotations to answers known by positions, with the body's bone lengths",
        version="1",
        accepts=("motion", "positions"),
    )

    def supports(self, source: Character, target: Character) -> str | None:
        return None

    def process(self, prediction: Prediction, source: Prediction, *, context: Context) -> Motion:
        return prediction if isinstance(prediction, Motion) else fit.fit(prediction, source).motion


plugin = Fit
