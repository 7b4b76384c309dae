"""Foot contacts by speed: agreement of predicted contacts with the reference's or the source's."""

from collections.abc import Mapping

from retarget_bench.api import Metric, MetricCard, Value, against_source
from retarget_bench.api.comparison import Comparison, ContactLabels
from retarget_bench.motion.contact import CONTACT_SPEED

RULE = (
    f"found: |p(t) - p(t-1)| * fps / 30 < {CONTACT_SPEED:g} h; pooled over frames and joints, without the "
    "first frame, which has no speed; joints: foot and toe of both sides, where present, and the fore "
    "paws of four-legged targets; left out where no label says contact"
)
LABELS = (
    "true: the case's own labels where the data set knows them, else the reference's by the rule for found"
)
SOURCE_LABELS = (
    "true: the source's labels by the rule for found with its own height, joints matched by role"
)


def _value(id_: str, label: str, meaning: str, share: str) -> Value:
    return Value(
        id=id_,
        label=label,
        meaning=meaning,
        unit="1",
        better="higher",
        formula=f"{share}; {LABELS}; {RULE}",
        source_formula=f"{share}; {SOURCE_LABELS}; {RULE}",
        source="the project's contact protocol by speed, as in SAN's foot fixing (0.003 heights per frame)",
        tolerance=1e-3,
    )


class ContactSpeed(Metric):
    """Recall, precision and F1. Recall alone misleads: a frozen foot scores 1."""

    card = MetricCard(
        name="contact_speed",
        summary="foot contacts found by speed: recall, precision and F1",
        version="1",
        values=(
            _value(
                "contact_recall.speed",
                "contact recall, by speed",
                "share of the reference's contact frames in which the foot is slow enough to be in contact",
                "true contacts found / true contacts",
            ),
            _value(
                "contact_precision.speed",
                "contact precision, by speed",
                "share of the contact frames found that the reference has too",
                "true contacts found / contacts found (0 where none is found)",
            ),
            _value(
                "contact_f1.speed",
                "contact F1, by speed",
                "harmonic mean of contact recall and precision, against the reference",
                "2 * true contacts found / (contacts found + true contacts)",
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out where the target has no feet or nothing is labelled a contact."""
        values: dict[str, float] = {}
        if (labels := comparison.contact_labels) is not None:
            values |= agreement(labels)
        if (labels := comparison.source_contact_labels) is not None:
            values |= {against_source(id_): number for id_, number in agreement(labels).items()}
        return values


def agreement(labels: ContactLabels) -> dict[str, float]:
    """Recall, precision and F1 of the labels found, first frame left out; empty without true contacts."""
    expected, predicted = labels.planted[1:], labels.predicted[1:]
    true, claimed = int(expected.sum()), int(predicted.sum())
    hits = int((expected & predicted).sum())
    if true == 0:
        return {}
    return {
        "contact_recall.speed": hits / true,
        "contact_precision.speed": hits / claimed if claimed else 0.0,
        "contact_f1.speed": 2 * hits / (claimed + true),
    }


plugin = ContactSpeed
