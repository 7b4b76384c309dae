"""Values of sets of our answers in the columns of a published table, and the floor."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from retarget_bench.analysis.ranking import never_ranked
from retarget_bench.api import CROSS
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import compatibility
from retarget_bench.results.compatibility import Newest
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix
from retarget_bench.tables.model import Cell, count
from retarget_bench.tables.published.ours import OurRow, about, counted, missing, number_cell
from retarget_bench.tables.published.printed import PublishedTable

FLOOR, FLOOR_MARK = "floor", "real motion against real motion"

Values = Mapping[str, Mapping[str, SetValue]]
"""Label of a column -> structure of the targets -> value."""


def of_sets(table: PublishedTable, matrices: Sequence[ResultMatrix]) -> tuple[list[OurRow], list[str]]:
    """Rows by data set and name, with the floor, the score of real motion; and sentences on what their
    numbers are over.

    Only complete results without references count (their headers say which structures have four legs). Of a
    method with several seeds, the first. A column's number is the mean over the structures that have one.
    """
    all_rows: list[OurRow] = []
    notes: list[str] = []
    for matrix in (each for each in matrices if each.split == CROSS):
        headers = [row.header for each in matrices if each.dataset == matrix.dataset for row in each.rows]
        newest = compatibility.newest(headers)
        values = {row.label: _values(table, row, newest) for row in matrix.rows}
        usual = {column.label: _usual(values.values(), column.label) for column in table.columns}
        floors = {
            label: {name: replace(each, value=each.floor) for name, each in sets.items()}
            for label, sets in usual.items()
        }
        where, rows = matrix.dataset, []
        if any(floors.values()):
            rows.append(OurRow(where, FLOOR, FLOOR_MARK, _cells(table, floors, usual)))
        for row in matrix.rows:
            if any(values[row.label].values()):
                cells = _cells(table, values[row.label], usual)
                method = row.header.method
                rows.append(OurRow(where, row.label, never_ranked(method), cells, about(method)))
        all_rows += sorted(rows, key=lambda row: row.label)
        notes += _counts(where, rows)
    return all_rows, notes


def _values(table: PublishedTable, row: MethodRow, newest: Newest) -> Values:
    """The values of a method by column; none where its results do not count."""
    header = row.header
    if header.four_legged is None or not row.paths.complete or newest.why_outdated(header):
        return {}
    stored = set_metrics.read(row.paths)
    stored = [each for each in stored if not newest.why_value_outdated(header, each.value_id)]
    values: dict[str, dict[str, SetValue]] = {}
    for column in table.columns:  # values of its kind, and of structures of as many legs
        legs, _, kind = column.cases.partition(" legs")
        which = column.value_id, kind.strip(), legs == "4"
        values[column.label] = {
            each.structure: each
            for each in stored
            if (each.value_id, each.kind, each.structure in header.four_legged) == which
        }
    return values


def _usual(values: Iterable[Values], label: str) -> dict[str, SetValue]:
    """Per structure one of the values of a column with the most common real set."""
    sets: dict[str, list[SetValue]] = {}
    for each in (each for by_column in values for each in by_column.get(label, {}).values()):
        sets.setdefault(each.structure, []).append(each)
    usual = {}
    for structure, of_structure in sets.items():
        having = [each for each in of_structure if each.value is not None] or of_structure
        real = Counter(each.real for each in having).most_common(1)[0][0]
        usual[structure] = next(each for each in having if each.real == real)
    return usual


def _cells(table: PublishedTable, values: Values, usual: Values) -> dict[str, Cell]:
    """The cells of a row. usual: the values of the sets that most methods are compared with."""
    cells = {}
    for column in table.columns:
        sets = values[column.label]
        having = [each for each in sets.values() if each.value is not None]
        if not having:
            reasons = dict.fromkeys(each.reason for each in sets.values())
            cells[column.label] = missing(column, "; ".join(reasons))
            continue
        mean = float(np.mean([each.value for each in having if each.value is not None]))
        real = {name: each.real for name, each in usual[column.label].items() if each.value is not None}
        reason = ""
        if lacking := len(set(real) - {each.structure for each in having}):
            reason = f"over {count(lacking, 'structure')} fewer than the others; not comparable with them"
        elif any(each.real != real.get(each.structure, each.real) for each in having):
            reason = "over other windows than the others, since it did not answer the same cases"
        cells[column.label] = replace(
            number_cell(mean, None, table.decimals(column.label)),
            n=min(each.n for each in having),
            clips=min(each.clips for each in having),
            reason=reason,
        )
    return cells


def _counts(where: str, rows: Sequence[OurRow]) -> tuple[str, ...]:
    """A sentence on the least windows and clips that the columns are over."""
    over: dict[str, list[str]] = {}
    for label in rows[0].cells if rows else ():
        if cells := [row.numbers[label] for row in rows if label in row.numbers]:
            least = min(cells, key=lambda cell: cell.n)
            counts = f"{count(least.n, 'window')} in each set, {count(least.clips, 'clip')}"
            over.setdefault(counts, []).append(label)
    return counted(where, over)
