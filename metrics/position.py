"""Position errors relative to height: MPJPE (the primary protocol), end effectors, root path."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value, protocol
from retarget_bench.api.comparison import Comparison
from retarget_bench.motion.roles import END_EFFECTORS

PRIMARY = "the project's primary protocol"
JOINTS = (
    "joints: the target's own, fingers and props only where the source has the same ones, end sites and "
    "'virtual' copies never; h: the target's bone lengths from the hips to the last joint of the leg + "
    "from the hips to the last joint of the head"
)
ENDS = "head, hands, feet, toes"
_value = partial(Value, unit="% of height", better="lower", source=PRIMARY)


class Position(Metric):
    """Distances between the joints of prediction and reference."""

    card = MetricCard(
        name="position",
        summary="joint position errors: MPJPE, end effectors, root path",
        version="1",
        values=(
            _value(
                "mpjpe_h.world",
                "MPJPE",
                "mean joint position error, with root translation",
                formula=f"100 * mean over frames and joints of |p - g| / h; no alignment; {JOINTS}",
                protocol=protocol(),
            ),
            _value(
                "mpjpe_h.root",
                "MPJPE, root-aligned",
                "mean joint position error relative to the root: the pose alone",
                formula=(
                    "100 * mean over frames and joints of |(p - p_hips) - (g - g_hips)| / h; orientation "
                    f"kept; the hips themselves count, with 0; {JOINTS}"
                ),
                protocol=protocol(placed="hips"),
            ),
            _value(
                "mpjpe_h.joint",
                "MPJPE by joint, root-aligned",
                "position error of each joint relative to the root",
                formula=(
                    "per joint 100 * mean over frames of |(p - p_hips) - (g - g_hips)| / h; the mean over "
                    "joints is mpjpe_h.root"
                ),
                index="joint",
            ),
            _value(
                "ee_h.world",
                "end-effector error",
                "mean position error of head, hands, feet and toes, with root translation",
                formula="mpjpe_h.world over the joints with role head, hand, foot or toe",
                protocol=protocol(joints=ENDS),
            ),
            _value(
                "ee_h.root",
                "end-effector error, root-aligned",
                "mean position error of head, hands, feet and toes relative to the root",
                formula="mpjpe_h.root over the joints with role head, hand, foot or toe",
                protocol=protocol(joints=ENDS, placed="hips"),
            ),
            _value(
                "root_path.horizontal",
                "root error, horizontal",
                "mean horizontal distance of the hips from the reference's",
                formula="100 * mean over frames of the length of the x, z part of p_hips - g_hips / h",
            ),
            _value(
                "root_path.vertical",
                "root error, vertical",
                "mean vertical distance of the hips from the reference's",
                formula="100 * mean over frames of the absolute y part of p_hips - g_hips / h",
            ),
            _value(
                "root_path.drift",
                "root drift",
                "horizontal distance of the hips at the end, with both paths starting at one place",
                formula=(
                    "100 * |d(last) - d(first)| / h with d the x, z part of p_hips - g_hips; left out for "
                    "clips of one frame"
                ),
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float | Mapping[str, float]]:
        """Left out without a reference; ``ee_h`` where the target has no end effector."""
        world, centred = comparison.distances, comparison.centred_distances
        if world is None or centred is None:
            return {}
        joints, names = comparison.joints, comparison.target.skeleton.names
        scale = 100.0 / comparison.height
        by_joint = centred[:, joints].mean(axis=0) * scale
        values: dict[str, float | Mapping[str, float]] = {
            "mpjpe_h.world": float(world[:, joints].mean()) * scale,
            "mpjpe_h.root": float(by_joint.mean()),
            "mpjpe_h.joint": {names[j]: float(v) for j, v in zip(joints, by_joint, strict=True)},
        }
        if ends := comparison.target.joints(END_EFFECTORS):
            values["ee_h.world"] = float(world[:, ends].mean()) * scale
            values["ee_h.root"] = float(centred[:, ends].mean()) * scale
        assert comparison.offsets is not None
        offset = comparison.offsets[:, comparison.hips]
        values["root_path.horizontal"] = float(np.hypot(offset[:, 0], offset[:, 2]).mean()) * scale
        values["root_path.vertical"] = float(np.abs(offset[:, 1]).mean()) * scale
        if len(offset) > 1:
            drift = offset[-1] - offset[0]
            values["root_path.drift"] = float(np.hypot(drift[0], drift[2])) * scale
        return values


plugin = Position
