"""Our rows of published tables that compare whole sets of answers: values of sets on targets of two or four
legs, and what real motion scores in their place."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from retarget_bench.analysis.summary import never_ranked
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import compatibility, store
from retarget_bench.results.header import ResultHeader
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables.published.published_tables import (
    OwnCell,
    OwnRow,
    PublishedColumn,
    PublishedTable,
)

FLOOR, FLOOR_MARK = "floor", "real motion against real motion"


@dataclass(frozen=True)
class _Result:
    """One result file: its header, and what its sets say."""

    header: ResultHeader
    place: ResultPaths
    values: Sequence[SetValue]

    @property
    def dataset(self) -> str:
        return self.header.dataset.label

    def label(self, several: bool) -> str:
        name = self.header.method.label
        return f"{name} ({self.place.root})" if several else name

    def of(self, column: PublishedColumn) -> list[SetValue]:
        """The values of a column, one per structure of that many legs."""
        four = set(self.header.four_legged or ())
        return [
            each
            for each in self.values
            if (each.value_id, each.kind) == (column.value, column.kind)
            and (each.structure in four) == (column.legs == 4)
        ]


def own_rows(table: PublishedTable, places: Sequence[ResultPaths]) -> list[OwnRow]:
    """Our methods in the columns of a table of sets, and the floor of each data set.

    Only results without references count (their headers say which structures have four legs). Of a method
    with several seeds, the first. A column's number is the mean over the structures that have one.
    Raises FileError where a result cannot be read.
    """
    found = list(_results(dict.fromkeys(places)))
    names = Counter((each.dataset, each.header.method.label) for each in found)
    rows = []
    for each in found:
        label = each.label(names[each.dataset, each.header.method.label] > 1)
        rows.append(_row(table, each, label))
    datasets = dict.fromkeys(each.dataset for each in found)
    rows += [_floor(table, [each for each in found if each.dataset == name]) for name in datasets]
    return [row for row in rows if row.cells or row.reasons]


def _results(places: Iterable[ResultPaths]) -> Iterable[_Result]:
    there = [(place, store.read_header(place.header)) for place in places]
    newest = compatibility.newest_by_label(header for _, header in there)
    for place, header in there:
        if header.four_legged is None or place.split != "cross" or ".seed-" in place.method:
            continue
        latest = newest[header.dataset.label]
        values = [each for each in set_metrics.read(place) if not latest.stale_value(header, each.value_id)]
        if values and not latest.stale_data(header):
            yield _Result(header, place, values)


def _row(table: PublishedTable, result: _Result, label: str) -> OwnRow:
    cells, reasons = {}, {}
    for column in table.columns:
        values = result.of(column)
        numbers = [each for each in values if each.value is not None]
        if numbers:
            cells[column.id] = _cell(numbers, [each.value for each in numbers if each.value is not None])
        elif values:
            reasons[column.id] = "; ".join(dict.fromkeys(each.reason for each in values))
    facts = result.header.dataset
    return OwnRow(label, result.dataset, facts.name, never_ranked(result.header.method), cells, reasons)


def _floor(table: PublishedTable, results: Sequence[_Result]) -> OwnRow:
    """What most results of a data set were drawn against."""
    cells, reasons = {}, {}
    for column in table.columns:
        usual = _usual([each for result in results for each in result.of(column)])
        if floors := [each.floor for each in usual if each.floor is not None]:
            cells[column.id] = _cell(usual, floors)
        elif usual:
            reasons[column.id] = "; ".join(dict.fromkeys(each.reason for each in usual))
    facts = results[0].header.dataset
    return OwnRow(FLOOR, results[0].dataset, facts.name, FLOOR_MARK, cells, reasons)


def _usual(values: Sequence[SetValue]) -> list[SetValue]:
    """Per structure one of the values with the most common real set."""
    found = []
    for structure in dict.fromkeys(each.structure for each in values):
        mine = [each for each in values if each.structure == structure]
        given = [each for each in mine if each.value is not None] or mine
        real = Counter(each.real for each in given).most_common(1)[0][0]
        found.append(next(each for each in given if each.real == real))
    return found


def _cell(values: Sequence[SetValue], numbers: Sequence[float]) -> OwnCell:
    least = min(values, key=lambda each: each.n)
    clips = min(each.clips for each in values)
    return OwnCell(float(np.mean(numbers)), 0.0, least.n, clips, len(numbers))
