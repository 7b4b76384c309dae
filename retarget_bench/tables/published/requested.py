"""Published tables as somebody asks for them: of chosen methods, on one group of bodies."""

from collections.abc import Sequence
from dataclasses import replace

from retarget_bench.analysis.selection import Selection
from retarget_bench.errors import BenchError
from retarget_bench.results.result_matrix import ResultMatrix, result_matrices
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables.model import Table
from retarget_bench.tables.published import published_tables
from retarget_bench.tables.published.layout import paper_table
from retarget_bench.tables.published.own_rows import own_rows
from retarget_bench.tables.published.own_set_rows import own_set_rows
from retarget_bench.tables.published.published_tables import PublishedTable
from retarget_bench.tables.requested import others, wanted_group


def requested(name: str, places: Sequence[ResultPaths], select: Selection, bodies: str = "") -> Table:
    """A published table with results in it.

    bodies: of ``selection.BODIES``, or ``all``, each group apart; "": people, or all where there are none.
    Raises BenchError for a table, methods or bodies that there are none of.
    """
    table = published_tables.published(name)
    if table.of_sets:
        if bodies:
            raise BenchError(f"{name} is between bodies on two legs and on four by itself; leave --bodies")
        parts = replace(select, apart=False).parts(result_matrices(places))
        chosen = [path for part in parts for row in part.rows for path in row.all_paths]
        return paper_table(table, own_set_rows(table, chosen))
    matrices, hints = _of_bodies(select.parts(result_matrices(places)), bodies, table)
    if any(column.seen for column in table.columns):
        table = published_tables.with_structures(table, matrices)
    made = paper_table(table, own_rows(table, matrices))
    so_far = (f"{matrix.split}: {matrix.so_far}" for matrix in matrices if matrix.so_far)
    return replace(made, hints=(*so_far, *hints))


def _of_bodies(
    matrices: Sequence[ResultMatrix], bodies: str, table: PublishedTable
) -> tuple[list[ResultMatrix], list[str]]:
    """The matrices of a group of bodies, and sentences about what is left out."""
    wanted = wanted_group([matrix.bodies for matrix in matrices], bodies)
    if wanted == "all":
        return list(matrices), []
    asked = {split for column in table.columns for split in column.splits}
    cases: dict[str, int] = {}
    for each in matrices:
        if each.bodies != wanted and (each.split in asked or not asked):
            cases[each.bodies] = cases.get(each.bodies, 0) + int(each.own.sum())
    hints = [f"Not shown: {', '.join(others(cases))}."] if cases else []
    return [matrix for matrix in matrices if matrix.bodies == wanted], hints
