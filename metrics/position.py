"""Position errors relative to height: MPJPE (the primary protocol), end effectors, root path."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import MetricCard, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.motion.roles import END_EFFECTORS

PRIMARY = "the project's primary protocol"
JOINTS = (
    "joints: the target's own, fingers and props only where the source has the same ones, end sites and "
    "'virtual' copies never; h: the target's bone lengths from the hips to the last joint of the leg + "
    "from the hips to the last joint of the head"
)
PER_CENT = "% of height"


def _protocol(divided_by: str, placed: str, joints: str = "native") -> dict[str, str]:
    return {
        "error": "distance",
        "divided by": divided_by,
        "joints": joints,
        "placed": placed,
        "frames": "all",
        "self pairs": "apart",
    }


class Position:
    """Distances between the joints of prediction and reference."""

    card = MetricCard(
        name="position",
        summary="joint position errors: MPJPE, end effectors, root path",
        version="1",
        values=(
            Value(
                id="mpjpe_h.world",
                label="MPJPE",
                meaning="mean joint position error, with root translation",
                unit=PER_CENT,
                better="lower",
                formula=f"100 * mean over frames and joints of |p - g| / h; no alignment; {JOINTS}",
                source=PRIMARY,
                protocol=_protocol("h", "world"),
            ),
            Value(
                id="mpjpe_h.root",
                label="MPJPE, root-aligned",
                meaning="mean joint position error relative to the root: the pose alone",
                unit=PER_CENT,
                better="lower",
                formula=(
                    "100 * mean over frames and joints of |(p - p_hips) - (g - g_hips)| / h; orientation "
                    f"kept; the hips themselves count, with 0; {JOINTS}"
                ),
                source=PRIMARY,
                protocol=_protocol("h", "hips"),
            ),
            Value(
                id="mpjpe_h.joint",
                label="MPJPE by joint, root-aligned",
                meaning="position error of each joint relative to the root",
                unit=PER_CENT,
                better="lower",
                formula=(
                    "per joint 100 * mean over frames of |(p - p_hips) - (g - g_hips)| / h; the mean over "
                    "joints is mpjpe_h.root"
                ),
                source=PRIMARY,
                index="joint",
            ),
            Value(
                id="mpjpe_m",
                label="MPJPE in metres",
                meaning="mean joint position error in metres, with root translation",
                unit="m",
                better="lower",
                formula="mean over frames and joints of |p - g|; no alignment; joints as mpjpe_h.world",
                source="mpjpe_m as printed for SMPL bodies: global, not aligned",
                protocol=_protocol("1", "world"),
            ),
            Value(
                id="ee_h.world",
                label="end-effector error",
                meaning="mean position error of head, hands, feet and toes, with root translation",
                unit=PER_CENT,
                better="lower",
                formula="mpjpe_h.world over the joints with role head, hand, foot or toe",
                source=PRIMARY,
                protocol=_protocol("h", "world", "head, hands, feet, toes"),
            ),
            Value(
                id="ee_h.root",
                label="end-effector error, root-aligned",
                meaning="mean position error of head, hands, feet and toes relative to the root",
                unit=PER_CENT,
                better="lower",
                formula="mpjpe_h.root over the joints with role head, hand, foot or toe",
                source=PRIMARY,
                protocol=_protocol("h", "hips", "head, hands, feet, toes"),
            ),
            Value(
                id="root_path.horizontal",
                label="root error, horizontal",
                meaning="mean horizontal distance of the hips from the reference's",
                unit=PER_CENT,
                better="lower",
                formula="100 * mean over frames of the length of the x, z part of p_hips - g_hips / h",
                source=PRIMARY,
            ),
            Value(
                id="root_path.vertical",
                label="root error, vertical",
                meaning="mean vertical distance of the hips from the reference's",
                unit=PER_CENT,
                better="lower",
                formula="100 * mean over frames of the absolute y part of p_hips - g_hips / h",
                source=PRIMARY,
            ),
            Value(
                id="root_path.drift",
                label="root drift",
                meaning="horizontal distance of the hips at the end, with both paths starting at one place",
                unit=PER_CENT,
                better="lower",
                formula=(
                    "100 * |d(last) - d(first)| / h with d the x, z part of p_hips - g_hips; left out for "
                    "clips of one frame"
                ),
                source=PRIMARY,
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
        metres = float(world[:, joints].mean())
        values: dict[str, float | Mapping[str, float]] = {
            "mpjpe_h.world": metres * scale,
            "mpjpe_h.root": float(by_joint.mean()),
            "mpjpe_h.joint": {names[j]: float(v) for j, v in zip(joints, by_joint, strict=True)},
            "mpjpe_m": metres,
        }
        if ends := comparison.target.joints(END_EFFECTORS):
            values["ee_h.world"] = float(world[:, ends].mean()) * scale
            values["ee_h.root"] = float(centred[:, ends].mean()) * scale
        return values | _root_path(comparison, scale)


def _root_path(comparison: Comparison, scale: float) -> dict[str, float]:
    assert comparison.offsets is not None
    offset = comparison.offsets[:, comparison.hips]
    values = {
        "root_path.horizontal": float(np.hypot(offset[:, 0], offset[:, 2]).mean()) * scale,
        "root_path.vertical": float(np.abs(offset[:, 1]).mean()) * scale,
    }
    if len(offset) > 1:
        drift = offset[-1] - offset[0]
        values["root_path.drift"] = float(np.hypot(drift[0], drift[2])) * scale
    return values


plugin = Position
