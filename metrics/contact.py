"""Foot contacts by speed: agreement of predicted contacts with the reference's or the source's."""

from collections.abc import Mapping

from retarget_bench.api import MetricCard, Value
from retarget_bench.api.comparison import Comparison, ContactLabels
from retarget_bench.motion.contact import CONTACT_SPEED

KINDS = {
    "recall": (
        "contact recall, by speed",
        "share of {who}'s contact frames in which the foot is slow enough to be in contact",
        "true contacts found / true contacts",
    ),
    "precision": (
        "contact precision, by speed",
        "share of the contact frames found that {who} has too",
        "true contacts found / contacts found (0 where none is found)",
    ),
    "f1": (
        "contact F1, by speed",
        "harmonic mean of contact recall and precision, against {who}",
        "2 * true contacts found / (contacts found + true contacts)",
    ),
}
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


def _value(kind: str, *, source: bool) -> Value:
    label, meaning, share = KINDS[kind]
    return Value(
        id=f"contact_{kind}_src" if source else f"contact_{kind}",
        label=f"{label}, source" if source else label,
        meaning=meaning.format(who="the source" if source else "the reference"),
        unit="1",
        better="higher",
        formula=f"{share}; {SOURCE_LABELS if source else LABELS}; {RULE}",
        source="the project's contact protocol; speed rule of SAN's foot fixing (0.003 heights per frame)",
        tolerance=1e-3,
        needs=("source",) if source else ("reference",),
    )


class Contact:
    """Recall, precision and F1. Recall alone misleads: a frozen foot scores 1."""

    card = MetricCard(
        name="contact",
        summary="foot contacts found by speed: recall, precision and F1",
        version="1",
        values=tuple(_value(kind, source=source) for source in (False, True) for kind in KINDS),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out where the target has no feet or nothing is labelled a contact."""
        values: dict[str, float] = {}
        for suffix, schedule in (
            ("", comparison.contact_labels),
            ("_src", comparison.source_contact_labels),
        ):
            if schedule is not None:
                found = agreement(schedule)
                values |= {f"contact_{kind}{suffix}": value for kind, value in found.items()}
        return values


def agreement(schedule: ContactLabels) -> dict[str, float]:
    """Recall, precision and F1 of the labels found, first frame left out; empty without true contacts."""
    wanted, found = schedule.planted[1:], schedule.found[1:]
    true, claimed = int(wanted.sum()), int(found.sum())
    hits = int((wanted & found).sum())
    if true == 0:
        return {}
    return {
        "recall": hits / true,
        "precision": hits / claimed if claimed else 0.0,
        "f1": 2 * hits / (claimed + true),
    }


plugin = Contact
