"""Two methods compared on the results of several splits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from retarget_bench.analysis import pairwise, selection
from retarget_bench.analysis.pairwise import PairwiseComparison
from retarget_bench.analysis.ranking import Ranking
from retarget_bench.analysis.summary import split_summary
from retarget_bench.api import SELF
from retarget_bench.errors import BenchError
from retarget_bench.options import Names, OfBodies, OfSplits, listed, option
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix, result_matrices, set_values
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import cells, names
from retarget_bench.tables.builder import DEFAULT_COLUMNS, LISTED, entries, stand_in

PEOPLE_ALONE = "computed of all answers to bodies of one group: --bodies people"
Pair = tuple[MethodRow | None, MethodRow | None]


class PairOptions(OfSplits, OfBodies):
    """Two methods, and which of their values are compared."""

    first: str = option("A method, as tables call it.", kw_only=False)
    second: str = option("Another one.", kw_only=False)
    columns: Names = option(
        "Values to compare.", default=(), shown="those of bench table", metavar="ID,ID", kw_only=False
    )
    all: bool = option("Compare every value.", default=False)


def matrices_of(places: Sequence[ResultPaths], options: PairOptions) -> list[ResultMatrix]:
    """The results of all methods that tables rank, on the splits and of the bodies of the options.

    Self pairs are read whatever the splits: some values of other splits pool them.
    """
    splits = {place.split for place in selection.of_splits(places, listed(options.splits))}
    read = [place for place in places if place.split in {*splits, SELF}]
    chosen = [each for each in result_matrices(read) if each.split in splits]
    return selection.of_bodies(chosen, options.bodies)


def compare(
    matrices: Sequence[ResultMatrix],
    first: str,
    second: str,
    columns: Sequence[str] | None = None,
    everything: bool = False,
) -> list[PairwiseComparison]:
    """Two methods on every split that has both. columns: value ids; None: the columns of tables, or all.

    Raises BenchError for a method or value without results, and where no case has a number of both.
    """
    for name in (first, second):
        if not any(selection.find(matrix, name) for matrix in matrices):
            raise selection.unknown([row.label for matrix in matrices for row in matrix.rows], name)
    pairs = [(selection.find(matrix, first), selection.find(matrix, second)) for matrix in matrices]
    both = [(matrix, [pair]) for matrix, pair in zip(matrices, pairs, strict=True)]
    return compared(first, second, both, columns, everything, as_in_tables=True)


def compared(
    first: str,
    second: str,
    pairs: Sequence[tuple[ResultMatrix, Sequence[Pair]]],
    columns: Sequence[str] | None,
    everything: bool,
    as_in_tables: bool = False,
) -> list[PairwiseComparison]:
    """The comparisons of these pairs of rows that have a value in common. A note names those of the values
    asked for, or else of the columns of tables, that are left out.

    first, second: names of the two for errors. as_in_tables: whether the matrices have all rows of a table,
    whose verdicts hold where it has some. Raises BenchError for values that no result has, or that are
    curves, and where no case has a number of both.
    """
    if columns is not None and not columns:
        raise BenchError(f"name at least one value, such as {DEFAULT_COLUMNS[0]}; {LISTED}")
    declared, of_sets = names.declared([matrix for matrix, _ in pairs])
    ids = None if columns is None else names.value_ids(columns, declared | of_sets)
    for key in ids or ():
        if key in declared:
            names.check_of_cases(key, declared, {})
    comparisons = []
    for matrix, rows in pairs:
        rankings = table_rankings(matrix) if as_in_tables else {}
        keys = _values(matrix, ids, everything)
        for one, two in rows:
            if one and two:
                comparison = pairwise.compare(matrix, one, two, keys, rankings)
                comparisons.append(_with_note(comparison, matrix, one, two, ids))
    if shown := [each for each in comparisons if each.differences]:
        return shown
    progress = (pairwise.so_far(row) for _, rows in pairs for pair in rows for row in pair if row)
    waiting = dict.fromkeys(filter(None, progress))
    sentences = [f"{first} and {second} have no case in common that both have a number for", *waiting]
    raise BenchError("; ".join(sentences))


def table_rankings(matrix: ResultMatrix) -> Mapping[str, Ranking]:
    """The rankings of the table of a matrix, which has no variants; none while cases are missing."""
    if any(row.header.waiting for row in matrix.rows):
        return {}
    return split_summary(selection.without_variants(matrix)).rankings


def _values(matrix: ResultMatrix, columns: Sequence[str] | None, everything: bool) -> Sequence[str]:
    """Value ids to compare on a split: those asked for, all, or the columns of a table."""
    there = list(dict.fromkeys(value for value, index in matrix.keys if not index))
    there += set_values(row.header for row in matrix.rows)
    if everything:
        columns = entries(there)
    usual = DEFAULT_COLUMNS if columns is None else columns
    shown = [key for key in (stand_in(each, there) for each in usual) if key in there]
    return shown or (entries(there) if columns is None else [])


# ---------------------------------------------------------------------------------------------- left out
def _with_note(
    comparison: PairwiseComparison,
    matrix: ResultMatrix,
    one: MethodRow,
    two: MethodRow,
    columns: Sequence[str] | None,
) -> PairwiseComparison:
    """The comparison with a note on the values of tables, or of those asked for, that it lacks."""
    shown = {each.value for each in comparison.differences}
    of_sets = set_values(row.header for row in (one, two))
    left: dict[str, list[str]] = {}
    for key in DEFAULT_COLUMNS if columns is None else columns:
        if stand_in(key, shown) or key not in {**matrix.values, **of_sets}:
            continue
        if key in matrix.values:
            label, why = matrix.values[key].label, _why_missing(matrix, (one, two), key)
        else:
            label = of_sets[key].label
            why = "needs an interval of both, over the same windows" if matrix.bodies else PEOPLE_ALONE
        left.setdefault(why, []).append(label)
    if not left:
        return comparison
    reasons = "; ".join(f"{' and '.join(labels)} ({why})" for why, labels in left.items())
    return replace(comparison, notes=(*comparison.notes, f"not compared: {reasons}"))


def _why_missing(matrix: ResultMatrix, rows: Sequence[MethodRow], key: str) -> str:
    """The reason why no case has a number of both rows."""
    reasons: dict[str, list[str]] = {}
    for row in rows:
        if why := lacking(matrix, row, key):
            reasons.setdefault(why, []).append(row.label)
    return "; ".join(f"{', '.join(each)}: {why}" for why, each in reasons.items()) or "no case in common"


def lacking(matrix: ResultMatrix, row: MethodRow, key: str) -> str:
    """The reason why a row has no number of a value; "" where it has one."""
    (score,) = split_summary(replace(matrix, rows=(row,))).scores
    return "" if key in score.means else cells.lacking(matrix.values[key], [score])
