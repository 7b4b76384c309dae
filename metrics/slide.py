"""Foot skating: horizontal speed of feet that should be in contact with the ground."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import MetricCard, Value
from retarget_bench.api.comparison import RATE, Comparison, ContactLabels, steps

DEFINITION = (
    "mean over the steps t-1 -> t of contact joints that are labelled planted in both frames of "
    "|horizontal (x, z) part of p(t) - p(t-1)| * fps"
)
FIRST = (
    "where labels are found by speed, frame 0 has no speed and takes the label of frame 1, so that the "
    "first step counts where frame 1 is planted"
)
SCALES = {
    "": ("cm/frame", "* 100 / 30: centimetres per frame of 30 per second, whatever the clip's rate"),
    "_h": ("% of height/s", "* 100 / h"),
}


def _value(suffix: str, *, source: bool) -> Value:
    unit, scale = SCALES[suffix]
    labels = "contact_recall_src" if source else "contact_recall"
    return Value(
        id=f"foot_slide{suffix}_src" if source else f"foot_slide{suffix}",
        label="foot skating" + (", by height" if suffix else "") + (", source" if source else ""),
        meaning=(
            f"mean horizontal speed of the feet{', in heights,' if suffix else ''} during contacts of the "
            f"{'source' if source else 'reference'}"
        ),
        unit=unit,
        better="lower",
        formula=(
            f"{DEFINITION} {scale}; joints and true labels as {labels}; {FIRST}; left out where no joint "
            "is labelled planted in two frames in a row"
        ),
        source="mean horizontal displacement during true contacts, per frame as animation papers state it",
        tolerance=1e-4,
        needs=("source",) if source else ("reference",),
    )


class Slide:
    """Horizontal speed of the feet during true contacts, not during those found in the prediction."""

    card = MetricCard(
        name="slide",
        summary="foot skating: speed of the feet during contacts",
        version="1",
        values=tuple(_value(suffix, source=source) for source in (False, True) for suffix in SCALES),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out where the target has no feet or no contact lasts two frames."""
        values: dict[str, float] = {}
        for suffix, schedule in (
            ("", comparison.contact_labels),
            ("_src", comparison.source_contact_labels),
        ):
            if schedule is not None and (slide := _slide(comparison, schedule)) is not None:
                values[f"foot_slide{suffix}"] = 100.0 * slide
                values[f"foot_slide_h{suffix}"] = 100.0 * RATE * slide / comparison.height
        return values


def _slide(comparison: Comparison, schedule: ContactLabels) -> float | None:
    """Metres per frame of 30 per second; None where no contact lasts two frames."""
    stands = schedule.planted[1:] & schedule.planted[:-1]
    if not stands.any():
        return None
    moved = steps(comparison.predicted[:, schedule.joints], comparison.fps)[stands]
    return float(np.hypot(moved[:, 0], moved[:, 2]).mean())


plugin = Slide
