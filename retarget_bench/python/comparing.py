"""Two methods compared on the results of several splits."""

from __future__ import annotations

from collections.abc import Sequence

from retarget_bench.analysis import pairwise
from retarget_bench.analysis.pairwise import PairwiseComparison
from retarget_bench.errors import BenchError
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix
from retarget_bench.tables import names
from retarget_bench.tables.builder import DEFAULT_COLUMNS, stand_in

Pair = tuple[MethodRow | None, MethodRow | None]


def compare(
    matrices: Sequence[ResultMatrix],
    first: str,
    second: str,
    wanted: Sequence[str] | None = None,
    everything: bool = False,
) -> list[PairwiseComparison]:
    """Two methods on every split that has both. wanted: value ids; None: the columns of tables, or all.

    Raises BenchError for a method or value without results, and where no case has a number of both.
    """
    for name in (first, second):
        if not any(pairwise.find(matrix, name) for matrix in matrices):
            raise pairwise.unknown([row.label for matrix in matrices for row in matrix.rows], name)
    pairs = [(pairwise.find(matrix, first), pairwise.find(matrix, second)) for matrix in matrices]
    found = compared(
        [(matrix, [pair]) for matrix, pair in zip(matrices, pairs, strict=True)], wanted, everything
    )
    if not found:
        raise nothing_common(first, second, [row for pair in pairs for row in pair if row])
    return found


def nothing_common(first: str, second: str, rows: Sequence[MethodRow]) -> BenchError:
    """Why these rows cannot be compared."""
    waiting = dict.fromkeys(filter(None, map(pairwise.unfinished, rows)))
    said = [f"{first} and {second} have no case in common that both have a number for", *waiting]
    return BenchError("; ".join(said))


def compared(
    pairs: Sequence[tuple[ResultMatrix, Sequence[Pair]]], wanted: Sequence[str] | None, everything: bool
) -> list[PairwiseComparison]:
    """The comparisons of these pairs of rows that have a value in common. Raises BenchError for values that
    no result has, or that are curves."""
    wanted = _checked([matrix for matrix, _ in pairs], wanted)
    found = [
        pairwise.compare(matrix, one, two, _values(matrix, wanted, everything))
        for matrix, rows in pairs
        for one, two in rows
        if one and two
    ]
    return [each for each in found if each.differences]


def _checked(matrices: Sequence[ResultMatrix], wanted: Sequence[str] | None) -> list[str] | None:
    """The ids of the values asked for."""
    declared = {key: value for matrix in matrices for key, value in matrix.values.items()}
    known = sorted(key for key, value in declared.items() if not value.index)
    if wanted is not None and not wanted:
        raise BenchError(f"name at least one value; there are {', '.join(known)}")
    of_sets = {
        key: value
        for matrix in matrices
        for row in matrix.rows
        for key, value in row.header.set_values.items()
    }
    found = None if wanted is None else names.value_ids(wanted, declared | of_sets)
    if whole := next((key for key in found or () if key in of_sets), None):
        raise BenchError(
            f"{whole} is a value of all answers as one set, so that no cases can be compared; its interval "
            "stands in the table (bench table --intervals, or .table().frame)"
        )
    if curve := next((key for key in found or [] if key not in known), None):
        raise BenchError(f"{curve!r} is a curve; there are {', '.join(known)}")
    return found


def _values(matrix: ResultMatrix, wanted: Sequence[str] | None, everything: bool) -> Sequence[str]:
    """Value ids to compare on a split: those asked for, all, or the columns of a table."""
    there = list(dict.fromkeys(value for value, index in matrix.keys if not index))
    if everything:
        return there
    if wanted is not None:
        return wanted
    shown = (stand_in(key, there) for key in DEFAULT_COLUMNS)
    return [key for key in shown if key in there]
