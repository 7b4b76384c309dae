"""Smoothness: acceleration and jerk relative to the reference's or the source's, and bone lengths."""

from collections.abc import Mapping, Sequence

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value, against_source
from retarget_bench.api.comparison import RATE, Comparison, squared_length

STILL = 0.1
"""Heights per second to the order of the difference: below it a clip is still and has no ratio."""

JOINTS = "joints as mpjpe_h.world"
SHORT = {2: "left out for clips of fewer than 3 frames", 3: "left out for clips of fewer than 4 frames"}
NAMES = {2: "acceleration", 3: "jerk"}
SIZES = {
    2: "A = mean over frames and joints of |p(t+1) - 2 p(t) + p(t-1)| * fps^2",
    3: "J = mean over frames and joints of |p(t+2) - 3 p(t+1) + 3 p(t) - p(t-1)| * fps^3",
}
FIELD = "third differences as SAME and TransPose take them; ratio instead of size, after STaR's finding"


def _size(order: int) -> Value:
    name = NAMES[order]
    return Value(
        id=name,
        label=name,
        meaning=f"mean {name} of the joints; a description without a goal of its own",
        unit=f"m/s^{order}",
        better="none",
        formula=f"{SIZES[order]}; {JOINTS}; {SHORT[order]}",
        source=FIELD,
        tolerance=1e-2,
        needs=(),
    )


def _ratio(order: int) -> Value:
    name, letter = NAMES[order], SIZES[order][0]
    short = f"{SIZES[order]}; {SHORT[order]} and where the"
    still = f"'s is below {STILL:g} heights/s^{order} (a still clip)"
    return Value(
        id=f"{name}_ratio",
        label=f"{name} ratio",
        meaning=f"mean {name} over the reference's: above 1 is jittery, below 1 is over-smoothed",
        unit="1",
        better="target",
        formula=(
            f"{letter} of the prediction / {letter} of the reference, {JOINTS}; {short} reference{still}"
        ),
        source_formula=(
            f"{letter}/h of the prediction / {letter}/h of the source, over joints with one role in both, "
            f"each with its own h; {short} source{still}"
        ),
        source=FIELD,
        tolerance=1e-3,
    )


class Smoothness(Metric):
    """Differences over time, always scaled to seconds or to frames of 30 per second."""

    card = MetricCard(
        name="smoothness",
        summary="acceleration, jerk and constant bone lengths",
        version="1",
        values=(
            Value(
                id="acc",
                label="acceleration error",
                meaning="mean difference of joint accelerations from the reference's",
                unit="m/frame^2",
                better="lower",
                formula=(
                    "mean over frames and joints of |D(p) - D(g)| * (fps / 30)^2 with D(x) = x(t+1) - 2 "
                    f"x(t) + x(t-1); metres per squared frame of 30 per second; {JOINTS}; {SHORT[2]}"
                ),
                source="acc as printed for SMPL bodies: second finite differences, global, not aligned",
            ),
            _ratio(3),
            _ratio(2),
            _size(3),
            _size(2),
            Value(
                id="bone_drift",
                label="bone drift",
                meaning="mean difference of bones from their true length; 0 for predictions by rotations",
                unit="% of height",
                better="lower",
                formula=(
                    "100 * mean over frames and bones of ||p - p_parent| - length of the bone| / h, over "
                    "all bones of the target's skeleton; left out for a skeleton of one joint"
                ),
                source="bone-length consistency, this project",
                tolerance=1e-4,
                needs=(),
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out for clips that are too short, for ratios to still clips, and without what they need."""
        joints, height, fps = comparison.joints, comparison.height, comparison.fps
        own = _sizes(comparison.predicted, fps)
        values = _bone_drift(comparison)
        values |= {NAMES[order]: float(size[joints].mean()) for order, size in own.items()}
        if comparison.offsets is not None and comparison.expected is not None:
            if comparison.frames > 2:
                error = np.diff(comparison.offsets[:, joints], n=2, axis=0)
                values["acc"] = float(np.sqrt(squared_length(error)).mean()) * (fps / RATE) ** 2
            true = _sizes(comparison.expected[:, joints], fps)
            values |= _ratios(own, joints, height, true, height)
        source, roles = comparison.case.source, comparison.target.roles
        at_source, at_target = comparison.shared([role for j in joints if (role := roles[j]) is not None])
        if at_source and (source_height := float(source.character.height)) > 0:
            source_sizes = _sizes(source.positions[:, at_source], fps)
            ratios = _ratios(own, at_target, height, source_sizes, source_height)
            values |= {against_source(id_): number for id_, number in ratios.items()}
        return values


def _ratios(
    own: Mapping[int, np.ndarray],
    joints: Sequence[int] | np.ndarray,
    height: float,
    other: Mapping[int, np.ndarray],
    other_height: float,
) -> dict[str, float]:
    """Ratios of the means over joints, in heights; left out where the other side is still."""
    ratios = {}
    for order, size in other.items():
        below = float((size / other_height).mean())
        if below >= STILL:
            ratios[f"{NAMES[order]}_ratio"] = float((own[order][joints] / height).mean()) / below
    return ratios


def _sizes(positions: np.ndarray, fps: float) -> dict[int, np.ndarray]:
    """Order -> ``(joints,)`` m/s^order: mean size of the differences of positions ``(frames, joints, 3)``.

    Orders that need more frames than there are, are missing.
    """
    sizes, difference = {}, np.diff(positions, axis=0)
    for order in NAMES:
        difference = difference[1:] - difference[:-1]
        if len(difference):
            sizes[order] = np.sqrt(squared_length(difference)).mean(axis=0) * fps**order
    return sizes


def _bone_drift(comparison: Comparison) -> dict[str, float]:
    skeleton, places = comparison.target.skeleton, comparison.predicted
    if len(skeleton) < 2:
        return {}
    bones = places[:, 1:] - places[:, skeleton.parents[1:]]
    off = np.abs(np.sqrt(squared_length(bones)) - skeleton.bone_lengths[1:])
    return {"bone_drift": 100.0 * float(off.mean()) / comparison.height}


plugin = Smoothness
