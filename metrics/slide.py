"""Foot skating: horizontal speed of feet that should be in contact with the ground."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value, against_source
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


def _value(suffix: str) -> Value:
    unit, scale = SCALES[suffix]
    rule = f"{DEFINITION} {scale}; joints and true labels as"
    end = f"{FIRST}; left out where no joint is labelled planted in two frames in a row"
    return Value(
        id=f"foot_slide{suffix}",
        label="foot skating" + (", by height" if suffix else ""),
        meaning=(
            f"mean horizontal speed of the feet{', in heights,' if suffix else ''} during contacts of the "
            "reference"
        ),
        unit=unit,
        better="lower",
        formula=f"{rule} contact_recall.speed; {end}",
        source_formula=f"{rule} contact_recall.speed_src; {end}",
        source="mean horizontal displacement during true contacts, per frame as animation papers state it",
        tolerance=1e-4,
    )


class Slide(Metric):
    """Horizontal speed of the feet during true contacts, not during those found in the prediction."""

    card = MetricCard(
        name="slide",
        summary="foot skating: speed of the feet during contacts",
        version="1",
        values=tuple(map(_value, SCALES)),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out where the target has no feet or no contact lasts two frames."""
        values = _scaled(comparison, comparison.contact_labels)
        against = _scaled(comparison, comparison.source_contact_labels)
        return values | {against_source(id_): number for id_, number in against.items()}


def _scaled(comparison: Comparison, labels: ContactLabels | None) -> dict[str, float]:
    """Both values with these labels; empty where there is none."""
    if labels is None or (slide := _slide(comparison, labels)) is None:
        return {}
    return {"foot_slide": 100.0 * slide, "foot_slide_h": 100.0 * RATE * slide / comparison.height}


def _slide(comparison: Comparison, labels: ContactLabels) -> float | None:
    """Metres per frame of 30 per second; None where no contact lasts two frames."""
    stands = labels.planted[1:] & labels.planted[:-1]
    if not stands.any():
        return None
    moved = steps(comparison.predicted[:, labels.joints], comparison.fps)[stands]
    return float(np.hypot(moved[:, 0], moved[:, 2]).mean())


plugin = Slide
