"""What a table shows, in one sentence made of its marks, its numbers and the headers of its methods."""

from collections.abc import Sequence

from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.api import CROSS, INTRA, SELF
from retarget_bench.tables.model import Column, Group, Row, listed

WHERE = {CROSS: "across structures", INTRA: "within structures", SELF: "on their own bodies"}
"""The usual splits in words."""
RECALL = "contact_recall"
"""The value that says which share of contacts is kept."""
FEW = 3
"""So many methods at most are named."""


def finding(group: Group, found: Sequence[SplitSummary]) -> str:
    """Who is best on the first split, what learned methods keep of contacts, and how much of their papers'
    training they have had; "" where the table has none of these facts.

    group: methods by values, of which the columns of one split come first. found: of which it was made.
    """
    split = group.columns[0].split if group.columns else ""
    at = [number for number, column in enumerate(group.columns) if column.split == split]
    where = split or group.split
    where = WHERE.get(where, f"on {where}")
    shares = {
        score.label: score.header.method.training_share
        for section in found
        for score in section.scores
        if score.header.method.training_share is not None
    }
    learned = [row for row in group.ranked if row.learned]
    kept = _contacts(group, at, learned)
    subject = "they" if kept and len(learned) > 1 else ""
    clauses = [_best(group, at), kept, _training([row.label for row in learned], shares, subject)]
    said = "; ".join(filter(None, clauses[:2]))
    said = f"{where[0].upper()}{where[1:]} {said}" if said else ""
    return "; ".join(filter(None, [said, clauses[2]])) + "." if any(clauses) else ""


def _best(group: Group, at: Sequence[int]) -> str:
    """The best method of every column that has marks, and how many are tied with it."""
    columns: dict[str, list[str]] = {}
    for number in at:
        marks = {row.label: row.cells[number].mark for row in group.ranked}
        if best := [label for label, mark in marks.items() if mark == "best"]:
            ties = sum(mark == "tied" for mark in marks.values())
            tied = f" ({ties} tied)" if ties else ""
            columns.setdefault(best[0], []).append(group.columns[number].label + tied)
    said = [f"{label} by {listed(labels)}" for label, labels in columns.items()]
    if not said:
        return ""
    first, *others = said
    return listed([first.replace(" by ", " is best by ", 1), *others])


def _contacts(group: Group, at: Sequence[int], learned: Sequence[Row]) -> str:
    """The share of contacts that learned methods keep, and the best of the others."""
    number = next((n for n in at if group.columns[n].id == RECALL), None)
    if number is None:
        return ""
    column = group.columns[number]
    mine = _numbers(learned, number)
    others = _numbers([row for row in group.ranked if not row.learned], number)
    if not mine or not others:
        return ""
    best = max(others, key=others.__getitem__)
    least, most = (_percent(number, column) for number in (min(mine.values()), max(mine.values())))
    who = "learned methods keep" if len(mine) > 1 else f"{next(iter(mine))} keeps"
    kept = f"{least} %" if least == most else f"{least} to {most} %"
    return f"{who} {kept} of contacts, {best} {_percent(others[best], column)} %"


def _numbers(rows: Sequence[Row], number: int) -> dict[str, float]:
    cells = {row.label: row.cells[number].value for row in rows}
    return {label: value for label, value in cells.items() if value is not None}


def _percent(number: float, column: Column) -> str:
    return f"{number if column.unit == '%' else 100 * number:.0f}"


def _training(learned: Sequence[str], shares: dict[str, float], subject: str) -> str:
    """How much of their papers' training these methods have had, as far as it is known."""
    known = {label: shares[label] for label in learned if label in shares}
    if not known:
        return ""
    told = [f"{100 * share:.2g}" for share in sorted(known.values())]
    amount = f"{told[0]} %" if told[0] == told[-1] else f"{told[0]} to {told[-1]} %"
    if len(known) == 1:
        return f"{next(iter(known))} saw {amount} of its paper's training"
    if len(known) < len(learned):
        names = listed(list(known)) if len(known) <= FEW else f"{len(known)} learned methods"
        return f"{names} saw {amount} of their papers' training"
    return f"{subject or 'learned methods'} saw {amount} of their papers' training"
