"""The tables of a chapter."""

import difflib
from collections.abc import Sequence

from retarget_bench.analysis import summary
from retarget_bench.analysis.breakdown import By
from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.tasks import DERIVED
from retarget_bench.figures import method_order
from retarget_bench.results import result_matrix
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import builder, set_groups
from retarget_bench.tables.groups import FPS
from retarget_bench.tables.model import Table


def check(groups: Sequence[Sequence[ResultPaths]], columns: Sequence[str]) -> None:
    """Raises BenchError for a column that no results of any chapter have."""
    if not columns:
        return
    known: set[str] = set()
    for places in groups:
        known |= set(builder.all_columns(summary.split_summaries(places)))
    for column in columns:
        if column not in known:
            near = difflib.get_close_matches(column, known, 3, 0.5) or sorted(known)[:6]
            raise BenchError(
                f"no result has one number per case or set called {column!r}; there are {', '.join(near)}"
            )


def tables(
    places: Sequence[ResultPaths], sections: Sequence[SplitSummary], columns: Sequence[str]
) -> list[Table]:
    """The tables of one task on one data set. columns: those that it does not have are left out."""
    task = places[0].task.split("-")[0]
    there = set(builder.all_columns(sections))
    wanted = [column for column in columns if column in there]
    by: By | None = builder.TASK_BREAKDOWN[task] if task in DERIVED and task != "reconstruct" else None
    if by is not None:  # neither speeds nor values of sets are known by parts
        wanted = [column for column in wanted if column not in (FPS, *set_groups.declared(sections))]
    if not wanted:
        whole = task not in DERIVED
        return builder.tables(sections, with_sets=True) if whole else builder.task_tables(places, task)
    if by is None and not set(wanted) - {FPS, *set_groups.declared(sections)}:
        mains = (method_order.main_value(each, task) for each in result_matrix.result_matrices(places))
        wanted = [*dict.fromkeys(main for main in mains if main is not None), *wanted]
    return builder.tables(summary.split_summaries(places, by) if by else sections, wanted, by or "")
