"""Values of sets of our answers in the columns of a published table, and the floor."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from retarget_bench.analysis.ranking import never_ranked
from retarget_bench.api import CROSS
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import compatibility, store
from retarget_bench.results.compatibility import Newest
from retarget_bench.results.paths import SETS
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix
from retarget_bench.tables.model import Cell, count
from retarget_bench.tables.published.ours import OurRow, OurRows, number_cell, variant
from retarget_bench.tables.published.printed import Column, PublishedTable

FLOOR, FLOOR_MARK = "floor", "real motion against real motion"

Values = Mapping[str, Sequence[SetValue]]
"""Label of a column -> its values, one per structure of the targets."""


def of_sets(table: PublishedTable, matrices: Sequence[ResultMatrix]) -> list[OurRows]:
    """Rows per data set, with the floor: what real motion scores.

    Only complete results without references count (their headers say which structures have four legs). Of a
    method with several seeds, the first. A column's number is the mean over the structures that have one.
    """
    parts = []
    for matrix in (each for each in matrices if each.split == CROSS):
        headers = [row.header for each in matrices if each.dataset == matrix.dataset for row in each.rows]
        newest = compatibility.newest(headers)
        methods = [(row, _values(table, row, newest)) for row in matrix.rows]
        parts.append(_part(table, matrix.dataset, [(row, values) for row, values in methods if values]))
    return [part for part in parts if part.rows]


def _values(table: PublishedTable, row: MethodRow, newest: Newest) -> Values:
    """The values of a method by column; none where its results do not count."""
    place, header = row.paths, row.header
    if header.four_legged is None or not place.complete or newest.why_outdated(header):
        return {}
    store.verify(place, header, SETS)
    there = [
        each for each in set_metrics.read(place) if not newest.why_value_outdated(header, each.value_id)
    ]
    four = set(header.four_legged)
    return {
        column.label: [each for each in there if _is_of(column, each, four)] for column in table.columns
    }


def _is_of(column: Column, value: SetValue, four_legged: set[str]) -> bool:
    """True for a value of a column: of its kind, and of a structure of as many legs."""
    legs, _, kind = column.cases.partition(" legs")
    same = (value.value_id, value.kind) == (column.value_id, kind.strip())
    return same and (value.structure in four_legged) == (legs == "4")


def _part(table: PublishedTable, where: str, methods: Sequence[tuple[MethodRow, Values]]) -> OurRows:
    labels = [column.label for column in table.columns]
    usual = {label: _usual([each for _, values in methods for each in values[label]]) for label in labels}
    floors = {label: [replace(each, value=each.floor) for each in found] for label, found in usual.items()}
    rows = [_row(table, FLOOR, FLOOR_MARK, floors, usual)]
    for found, values in methods:
        row = _row(table, found.label, never_ranked(found.header.method), values, usual)
        rows.append(replace(row, variant=variant(found.header.method)))
    over: dict[str, list[str]] = {}
    for label in labels:
        if cells := [row.cells[label] for row in rows if label in row.cells]:
            least = min(cells, key=lambda cell: cell.n)
            told = f"{count(least.n, 'window')} in each set, {count(least.clips, 'clip')}"
            over.setdefault(told, []).append(label)
    notes = "; ".join(f"{', '.join(columns)}: {told}" for told, columns in over.items())
    kept = sorted((row for row in rows if row.cells or row.reasons), key=lambda row: row.label)
    return OurRows(where, tuple(kept), notes=(f"n, {where}: {notes}.",) if over else ())


def _row(table: PublishedTable, label: str, mark: str, values: Values, usual: Values) -> OurRow:
    """A row from the values of every column. usual: of the sets that most methods are compared with."""
    cells: dict[str, Cell] = {}
    reasons = {}
    for column, mine in values.items():
        numbers = {each.structure: each.value for each in mine if each.value is not None}
        having = [each for each in mine if each.structure in numbers]
        if having:
            cells[column] = replace(
                number_cell(float(np.mean([*numbers.values()])), None, table.decimals(column)),
                n=min(each.n for each in having),
                clips=min(each.clips for each in having),
                reason=_other_sets(having, usual[column]),
            )
        elif mine:
            reasons[column] = "; ".join(dict.fromkeys(each.reason for each in mine))
    return OurRow(label, mark, cells, reasons)


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
