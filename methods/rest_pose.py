"""Control: stands still in the reference pose where the source is on average."""

import numpy as np

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.motion import root_rules, transfer
from retarget_bench.motion.character import Character, Motion

_RULE = "hip_height"


class RestPose(Method):
    """A lower bound without any pose: a T-pose facing +Z, which never moves.

    It stands with its feet on the floor, at the source's mean place on the ground scaled by hip height.
    Its feet never slide and its contact recall is 1, which is why neither says much without precision.
    """

    card = MethodCard(
        name="rest_pose",
        summary="Control: the T-pose, standing still at the source's mean place",
        version="1",
        accepts=("motion", "positions"),
        control=True,
    )

    def supports(self, source: Character, target: Character) -> str | None:
        return transfer.reason(source, target) or root_rules.reason(_RULE, source, target)

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Motion:
        place = transfer.hips(source).mean(axis=0) * root_rules.ratios(_RULE, source.character, target)
        place[1] = target.measures.hip_height
        rotations = np.repeat(target.reference_pose[None], source.frames, axis=0)
        root = transfer.root_from_hips(target, rotations, np.tile(place, (source.frames, 1)))
        return target.motion(rotations, root, source.fps)


plugin = RestPose
