"""Holds feet where the source's feet rest: legs reach by two-bone IK, hips give way before knees lock."""

import numpy as np

from retarget_bench.api import Context, Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion import root_rules
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.planting import feet
from retarget_bench.motion.planting.cuts import joined, takes
from retarget_bench.motion.planting.plant import no_legs, plant
from retarget_bench.motion.planting.two_bone import Pose, rig_of
from retarget_bench.plugins.post_processors import Post, PostCard


class FootLock(Post):
    """The feet of ``ik`` under the answer of another method.

    Near the floor feet follow the source's own path, scaled by ``root_rule``, and stand at one place as
    long as the source's rest; well above it they stay where the answer has them. Hips give way where a
    planted foot is out of reach. Everything above the hips turns as in the answer.

    Four-legged bodies among themselves are held by all four feet. No training, no optimisation.
    """

    card = PostCard(
        name="footlock",
        summary="Holds feet where the source's feet rest, by the two-bone IK of ik",
        version="1",
        accepts=("motion",),
        parameters={"root_rule": "length whose ratio scales the paths of feet"},
    )

    def __init__(self, root_rule: root_rules.ScalingRule = "hip_height") -> None:
        self.foot_rule = root_rules.check(root_rule, root_rules.SCALING_RULES)

    def supports(self, source: Character, target: Character) -> str | None:
        return root_rules.reason(self.foot_rule, source, target) or no_legs(source) or no_legs(target)

    def process(self, prediction: Prediction, source: Prediction, *, context: Context) -> Motion:
        if not isinstance(source, Motion):
            raise NotSupported("footlock needs a source with rotations, not positions only")
        assert isinstance(prediction, Motion)
        turned, root = joined(
            self._planted(prediction.at(piece), source.at(piece)) for piece in takes(source)
        )
        return prediction.character.motion(turned, root, prediction.fps)

    def _planted(self, answer: Motion, source: Motion) -> tuple[np.ndarray, np.ndarray]:
        """Rotations and root path of an answer to a source without cuts."""
        body = answer.character
        pose = Pose(answer.rotations.copy(), answer.root.copy(), answer.positions, answer.global_rotations)
        ratios = root_rules.ratios(self.foot_rule, source.character, body)
        plant(feet.Exchange(source, rig_of(source.character), rig_of(body), pose, ratios))
        return pose.rotations, pose.root


plugin = FootLock
