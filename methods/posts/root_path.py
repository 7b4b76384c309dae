"""Another root rule for an answer whose path follows the source's by the heights of the hips."""

import numpy as np

from retarget_bench.api import Context, Prediction
from retarget_bench.motion import root_rules, transfer
from retarget_bench.motion.character import Character, Motion
from retarget_bench.plugins.post_processors import Post, PostCard

USUAL: root_rules.RootRule = "hip_height"
"""The rule that the path of learned methods follows."""


class RootPath(Post):
    """The whole body moved by what the source's path under another root rule differs from that by hip
    heights.

    Learned methods take the source's path, scaled by hip heights, and add what their networks make of it;
    what they add stays. Feet that stood still under the old rule slide under the new one, so that
    ``+footlock`` with the same rule comes after it. Methods with a parameter ``root_rule`` of their own
    need no post-processor.
    """

    card = PostCard(
        name="root_path",
        summary="Scales the root path by another rule",
        version="1",
        accepts=("motion", "positions"),
        parameters={"root_rule": "length whose ratio scales the root path"},
    )

    follows = USUAL

    def __init__(self, root_rule: root_rules.ScalingRule = "mixamo") -> None:
        self.root_rule = root_rules.check(root_rule, root_rules.SCALING_RULES)

    def supports(self, source: Character, target: Character) -> str | None:
        reasons = (root_rules.reason(rule, source, target) for rule in (USUAL, self.root_rule))
        return transfer.reason(source, target) or next(filter(None, reasons), None)

    def process(self, prediction: Prediction, source: Prediction, *, context: Context) -> Prediction:
        body = prediction.character
        usual, other = (root_rules.ratios(rule, source.character, body) for rule in (USUAL, self.root_rule))
        moved: np.ndarray = transfer.hips(source) * (other - usual)  # (frames, 3)
        if isinstance(prediction, Motion):
            return body.motion(prediction.rotations, prediction.root + moved, prediction.fps)
        return body.positions(prediction.positions + moved[:, None], prediction.fps)


plugin = RootPath
