"""Our methods in the columns of a published table of sets of answers, and the floor."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from retarget_bench.analysis.ranking import never_ranked
from retarget_bench.api import CROSS
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import compatibility, dataset_names, store
from retarget_bench.results.header import ResultHeader
from retarget_bench.results.paths import SETS, ResultPaths
from retarget_bench.tables.model import count
from retarget_bench.tables.published.own import Counts, OwnCell, OwnRow, OwnRows, variant
from retarget_bench.tables.published.published_tables import PublishedColumn, PublishedTable

FLOOR, FLOOR_MARK = "floor", "real motion against real motion"

Found = tuple[ResultHeader, ResultPaths, list[SetValue]]


def own_set_rows(table: PublishedTable, places: Sequence[ResultPaths]) -> list[OwnRows]:
    """Rows per data set, with the floor: what real motion scores.

    Only complete results without references count (their headers say which structures have four legs). Of a
    method with several seeds, the first. A column's number is the mean over the structures that have one.
    """
    there = dataset_names.headers(places)
    names = dataset_names.shown(there)
    newest = compatibility.newest_by_name((names[place], header) for place, header in there.items())
    results: dict[str, list[Found]] = {}
    for place, header in there.items():
        if header.four_legged is None or place.split != CROSS or ".seed-" in place.method:
            continue
        if not place.complete:
            continue
        latest = newest[names[place]]
        store.verify(place, header, SETS)
        values = [
            each for each in set_metrics.read(place) if not latest.why_value_outdated(header, each.value_id)
        ]
        if values and not latest.why_outdated(header):
            results.setdefault(names[place], []).append((header, place, values))
    return [_on(dataset, table, mine) for dataset, mine in results.items()]


def _on(dataset: str, table: PublishedTable, results: Sequence[Found]) -> OwnRows:
    names = Counter(header.method.label for header, _, _ in results)
    usual = {
        column.id: _usual(
            [each for header, _, all_of in results for each in _values(column, header, all_of)]
        )
        for column in table.columns
    }
    rows = [_row(FLOOR, FLOOR_MARK, "", usual, usual, lambda each: each.floor)]
    for header, place, values in results:
        label = header.method.label
        shown = label if names[label] == 1 else f"{label} ({place.root})"
        found = {column.id: _values(column, header, values) for column in table.columns}
        facts = shown, never_ranked(header.method), variant(header.method)
        rows.append(_row(*facts, found, usual, lambda each: each.value))
    rows = sorted((row for row in rows if row.cells or row.reasons), key=lambda row: row.label)
    counts = {}
    for column in table.columns:
        if over := [row.cells[column.id].over for row in rows if column.id in row.cells]:
            counts[column.id] = min(over, key=lambda each: each.cases)
    return OwnRows(dataset, "", tuple(rows), counts)


def _values(column: PublishedColumn, header: ResultHeader, values: Sequence[SetValue]) -> list[SetValue]:
    """The values of a column, one per structure of that many legs."""
    four = set(header.four_legged or ())
    return [
        each
        for each in values
        if (each.value_id, each.kind) == (column.value, column.kind)
        and (each.structure in four) == (column.legs == 4)
    ]


def _row(
    label: str,
    mark: str,
    which: str,
    values: Mapping[str, list[SetValue]],
    usual: Mapping[str, list[SetValue]],
    number: Callable[[SetValue], float | None],
) -> OwnRow:
    """A row from the values of every column. number: the value itself, or its floor."""
    cells, reasons = {}, {}
    for column, mine in values.items():
        if having := [(found, each) for each in mine if (found := number(each)) is not None]:
            mean = float(np.mean([found for found, _ in having]))
            n, clips = min(each.n for _, each in having), min(each.clips for _, each in having)
            note = _other_sets([each for _, each in having], usual[column])
            cells[column] = OwnCell(mean, 0.0, Counts(n, clips, len(having)), note=note)
        elif mine:
            reasons[column] = "; ".join(dict.fromkeys(each.reason for each in mine))
    return OwnRow(label, mark, cells, reasons, which)


def _other_sets(mine: Sequence[SetValue], usual: Sequence[SetValue]) -> str:
    """How a number is of other sets than most, or "": these two may not be compared."""
    real = {each.structure: each.real for each in usual if each.value is not None}
    if lacking := len(set(real) - {each.structure for each in mine}):
        return f"over {count(lacking, 'structure')} fewer than the others; not comparable with them"
    if any(each.real != real.get(each.structure, each.real) for each in mine):
        return "over other windows than the others, since it did not answer the same cases"
    return ""


def _usual(values: Sequence[SetValue]) -> list[SetValue]:
    """Per structure one of the values with the most common real set."""
    found = []
    for structure in dict.fromkeys(each.structure for each in values):
        mine = [each for each in values if each.structure == structure]
        given = [each for each in mine if each.value is not None] or mine
        real = Counter(each.real for each in given).most_common(1)[0][0]
        found.append(next(each for each in given if each.real == real))
    return found
