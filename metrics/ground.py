"""Ground contact: penetration of the floor, and floating of feet that should stand."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value
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
    "is lower; frames: those in which a contact joint is labelled planted (labels as "
    "contact_recall.speed); left out where there is none"
)


_value = partial(Value, better="lower", tolerance=1e-3)
_below = partial(
    _value,
    needs=("ground",),
    source="ground penetration as rate, mean and maximum; rate as rtcmp counts it (depth > 1 cm)",
)
_above = partial(
    _value,
    needs=("reference", "ground"),
    source="floating after PHUMA's list of faults, measured against the reference",
)


class GroundContact(Metric):
    """Joints are centres of joints, not soles: compare with the reference's own row."""

    card = MetricCard(
        name="ground",
        summary="penetration of the floor, and floating feet",
        version="1",
        values=(
            _below(
                "penetration.rate",
                "penetration rate",
                "share of frames in which a joint is more than a centimetre below the ground",
                unit="% of frames",
                formula=f"100 * frames with depth > 1 cm / frames; {DEPTH}",
            ),
            _below(
                "penetration.mean",
                "penetration depth, mean",
                "depth of the deepest joint below the ground, mean over all frames",
                unit="cm",
                formula=f"mean over frames of depth; {DEPTH}",
            ),
            _below(
                "penetration.max",
                "penetration depth, max",
                "largest depth of any joint below the ground",
                unit="cm",
                formula=f"maximum over frames of depth; {DEPTH}",
            ),
            _above(
                "floating.rate",
                "floating rate",
                "share of standing frames in which the lowest foot is over a centimetre too high",
                unit="% of frames",
                formula=f"100 * frames with gap > 1 cm / frames; {GAP}",
            ),
            _above(
                "floating.mean",
                "floating height, mean",
                "height of the lowest foot above its reference while it should stand, mean",
                unit="cm",
                formula=f"mean over frames of gap; {GAP}",
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
        schedule, expected = comparison.contact_labels, comparison.expected
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
    return np.asarray((places[..., 1] - floor).min(axis=1))


plugin = GroundContact
