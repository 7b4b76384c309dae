"""Ground contact: penetration of the floor, and floating of feet that should stand."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import MetricCard, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.motion.ground import ground_height

LIMIT = 0.01
"""Metres: depths and gaps up to this are no fault."""

DEPTH = (
    "depth: how far the deepest of the target's scored joints (as mpjpe_h.world) is below the "
    "ground under it, 0 where none is; the ground is the case's, flat at 0 where the data set says nothing"
)
GAP = (
    "gap: how much higher above its ground the lowest contact joint is than the reference's, 0 where it "
    "is lower; frames: those in which a contact joint is labelled planted (labels as contact_recall); "
    "left out where there is none"
)


def _value(id_: str, label: str, meaning: str, unit: str, formula: str) -> Value:
    below = id_.startswith("penetration")
    return Value(
        id=id_,
        label=label,
        meaning=meaning,
        unit=unit,
        better="lower",
        formula=f"{formula}; {DEPTH if below else GAP}",
        source=(
            "ground penetration as rate, mean and maximum; rate as rtcmp counts it (depth > 1 cm)"
            if below
            else "floating after PHUMA's list of faults, measured against the reference"
        ),
        tolerance=1e-3,
        needs=("ground",) if below else ("reference", "ground"),
    )


class GroundContact:
    """Joints are centres of joints, not soles: compare with the reference's own row."""

    card = MetricCard(
        name="ground",
        summary="penetration of the floor, and floating feet",
        version="1",
        values=(
            _value(
                "penetration.rate",
                "penetration rate",
                "share of frames in which a joint is more than a centimetre below the ground",
                "% of frames",
                "100 * frames with depth > 1 cm / frames",
            ),
            _value(
                "penetration.mean",
                "penetration depth, mean",
                "depth of the deepest joint below the ground, mean over all frames",
                "cm",
                "mean over frames of depth",
            ),
            _value(
                "penetration.max",
                "penetration depth, max",
                "largest depth of any joint below the ground",
                "cm",
                "maximum over frames of depth",
            ),
            _value(
                "floating.rate",
                "floating rate",
                "share of standing frames in which the lowest foot is over a centimetre too high",
                "% of frames",
                "100 * frames with gap > 1 cm / frames",
            ),
            _value(
                "floating.mean",
                "floating height, mean",
                "height of the lowest foot above its reference while it should stand, mean",
                "cm",
                "mean over frames of gap",
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Floating is left out without a reference, and where no frame is labelled as standing."""
        depth = np.maximum(-_lowest(comparison, comparison.predicted[:, comparison.joints]), 0.0)
        values = {
            "penetration.rate": 100.0 * float((depth > LIMIT).mean()),
            "penetration.mean": 100.0 * float(depth.mean()),
            "penetration.max": 100.0 * float(depth.max()),
        }
        schedule, expected = comparison.schedule, comparison.expected
        if schedule is None or expected is None or not (stands := schedule.planted.any(axis=1)).any():
            return values
        feet = schedule.joints
        gap = _lowest(comparison, comparison.predicted[stands][:, feet])
        gap = np.maximum(gap - _lowest(comparison, expected[stands][:, feet]), 0.0)
        values["floating.rate"] = 100.0 * float((gap > LIMIT).mean())
        values["floating.mean"] = 100.0 * float(gap.mean())
        return values


def _lowest(comparison: Comparison, places: np.ndarray) -> np.ndarray:
    """``(frames,)`` metres above its ground of the lowest joint of ``(frames, joints, 3)``."""
    floor = ground_height(comparison.case.ground, places[..., 0], places[..., 2])
    lowest: np.ndarray = (places[..., 1] - floor).min(axis=1)
    return lowest


plugin = GroundContact
