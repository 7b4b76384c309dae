"""The finding of a table: one sentence made of its marks, its numbers and the headers of its methods."""

from collections.abc import Iterable, Mapping, Sequence

from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.api import CROSS, INTRA, SELF, TrainingShare
from retarget_bench.results.header import MethodInfo
from retarget_bench.tables.model import Group, Row, count, listed

WHERE = {CROSS: "across structures", INTRA: "within structures", SELF: "on their own bodies"}
"""The usual splits in words."""
RECALL = "contact_recall"
"""The share of contacts that is kept."""
FEW = 3
"""Methods that are named at most."""


def finding(group: Group, sections: Sequence[SplitSummary]) -> str:
    """The best methods on the first split, the share of contacts that learned methods keep, their share of
    their papers' training, and of which the authors' weights can be had; "" where the table has none of
    these facts.

    group: methods by values, of which the columns of one split come first. sections: of which it was made.
    """
    split = group.columns[0].split if group.columns else ""
    at = [number for number, column in enumerate(group.columns) if column.split == split]
    name = split or group.split
    where = f"{WHERE[name]} ({name})" if name in WHERE else f"on {name}"
    methods = {score.label: score.header.method for section in sections for score in section.scores}
    learned = [row for row in group.ranked if row.learned]
    contacts = _contacts(group, at, learned)
    subject = "they" if contacts and len(learned) > 1 else ""
    trained = {row.label: methods[row.label] for row in learned}
    sentence = "; ".join(filter(None, [_best(group, at), contacts]))
    sentence = f"{where[0].upper()}{where[1:]} {sentence}" if sentence else ""
    clauses = [sentence, _training(trained, subject), _authors(trained)]
    return "; ".join(filter(None, clauses)) + "." if any(clauses) else ""


def _best(group: Group, at: Sequence[int]) -> str:
    """The best methods of every column that has marks, and how many are tied with them."""
    columns: dict[tuple[str, ...], list[str]] = {}
    for number in at:
        marks = {row.label: row.cells[number].mark for row in group.ranked}
        if best := tuple(label for label, mark in marks.items() if mark == "best"):
            ties = sum(mark == "tied" for mark in marks.values())
            tied = f" ({count(ties, 'other')} tied)" if ties else ""
            columns.setdefault(best, []).append(group.columns[number].label + tied)
    clauses: list[str] = []
    for labels, values in columns.items():
        who = listed(labels) if len(labels) <= FEW else f"{len(labels)} methods"
        verb = "" if clauses else " are best" if len(labels) > 1 else " is best"
        clauses.append(f"{who}{verb} by {listed(values)}")
    return listed(clauses)


def _contacts(group: Group, at: Sequence[int], learned: Sequence[Row]) -> str:
    """The share of contacts that learned methods keep, the best of the others, and the rest of those."""
    number = next((n for n in at if group.columns[n].id == RECALL), None)
    if number is None:
        return ""
    per_cent = 1 if group.columns[number].unit == "%" else 100
    cells = {row.label: row.cells[number].value for row in group.ranked}
    others = {label: per_cent * value for label, value in cells.items() if value is not None}
    trained = {row.label: others.pop(row.label) for row in learned if row.label in others}
    if not trained or not others:
        return ""
    best = max(others, key=others.__getitem__)
    who = "learned methods keep" if len(trained) > 1 else f"{next(iter(trained))} keeps"
    sentence = f"{who} {_range(trained.values())} of contacts, {best} {others.pop(best):.0f} %"
    return sentence + (f", other untrained ones {_range(others.values())}" if others else "")


def _range(numbers: Iterable[float]) -> str:
    least, most = (f"{number:.0f}" for number in (min(numbers), max(numbers)))
    return f"{least} %" if least == most else f"{least} to {most} %"


def _training(learned: Mapping[str, MethodInfo], subject: str) -> str:
    """How much of their papers' training these methods have had, as far as it is known."""
    known = {label: method.training_share for label, method in learned.items()}
    shares = {label: share for label, share in known.items() if share is not None}
    if not shares:
        return ""
    ends = [TrainingShare(part) for part in (f(each.part for each in shares.values()) for f in (min, max))]
    low, high = (str(end) for end in ends)
    amount = "at least " * any(share.at_least for share in shares.values())
    amount += low if low == high else f"{low.removesuffix(' %')} to {high}"
    if len(shares) == len(learned) > 1:
        return f"{subject or 'learned methods'} saw {amount} of their papers' windows"
    each = [f"{label} saw {share}" for label, share in shares.items()]
    clause = listed(each) if len(shares) <= FEW else f"{len(shares)} learned methods saw {amount}"
    clause += " of its paper's windows" if len(shares) == 1 else " of their papers' windows"
    return clause + (", of others it is not known" if len(shares) < len(learned) else "")


def _authors(learned: Mapping[str, MethodInfo]) -> str:
    """Where the weights of their papers' authors can be had, of methods that have others."""
    others = (method for method in learned.values() if method.authors_weights and not method.is_by_authors)
    published = [f"bench info {name}" for name in sorted({method.name for method in others})]
    return f"authors' weights: {listed(published)}" if published else ""
