"""Rotation errors: geodesic angles between the joints of prediction and reference, in degrees."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.motion import rotation
from retarget_bench.motion.roles import is_tip

ANGLE = (
    "angle(a, b) = 2 atan2(|v|, |w|) of the quaternion a^-1 b = (w, v); joints: those of mpjpe_h.world "
    "that have an anatomical role, tips left out"
)
SOURCE = "geodesic distance on SO(3); qR of SAME (Lee et al. 2023), in degrees"
BOTH = "left out unless prediction and reference are both known by rotations"
_value = partial(
    Value,
    unit="degrees",
    better="lower",
    source=SOURCE,
    tolerance=1e-5,
    needs=("reference", "rotations"),
)


class Rotation(Metric):
    """Angles between rotations of one skeleton, which do not depend on its rest pose."""

    card = MetricCard(
        name="rotation",
        summary="geodesic angles between predicted and reference rotations",
        version="1",
        values=(
            _value(
                "rotation.local",
                "rotation error, local",
                "mean geodesic angle between local joint rotations and the reference's",
                formula=(
                    "mean over frames and joints of angle(local rotation, reference's local rotation); the "
                    f"root's local rotation is its orientation in the world; {ANGLE}; {BOTH}"
                ),
            ),
            _value(
                "rotation.world",
                "rotation error, global",
                "mean geodesic angle between global joint rotations and the reference's",
                formula=(
                    "mean over frames and joints of angle(world orientation, that of the reference); "
                    f"{ANGLE}; {BOTH}"
                ),
            ),
            _value(
                "rotation.joint",
                "rotation error by joint",
                "geodesic angle of each joint's local rotation from the reference's",
                formula="per joint the mean over frames of rotation.local's angle",
                index="joint",
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float | Mapping[str, float]]:
        """Left out unless both sides are known by rotations, and for a target without roles."""
        if comparison.motions is None:
            return {}
        predicted, expected = comparison.motions
        names, roles = comparison.target.skeleton.names, comparison.target.roles
        joints = [j for j in comparison.joints.tolist() if (role := roles[j]) and not is_tip(role)]
        if not joints:
            return {}
        local = rotation.angle(predicted.rotations[:, joints], expected.rotations[:, joints])
        world = rotation.angle(predicted.global_rotations[:, joints], expected.global_rotations[:, joints])
        by_joint = np.degrees(local.mean(axis=0))
        return {
            "rotation.local": float(by_joint.mean()),
            "rotation.world": float(np.degrees(world.mean())),
            "rotation.joint": {names[j]: float(v) for j, v in zip(joints, by_joint, strict=True)},
        }


plugin = Rotation
