"""Which tables a chapter has: the usual ones with all values of sets, or those of the columns asked for."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from retarget_bench import panel, placing, set_groups, summary, table
from retarget_bench.breakdown import By
from retarget_bench.cells import Table
from retarget_bench.errors import BenchError
from retarget_bench.grouping import FPS
from retarget_bench.records import Place
from retarget_bench.summary import Section
from retarget_bench.tasks import DERIVED
from retarget_bench.tasks.tables import BY, task_tables


def check(groups: Sequence[Sequence[Place]], columns: Sequence[str]) -> None:
    """Raises BenchError for a column that no results of any chapter have."""
    if not columns:
        return
    known: set[str] = set()
    for places in groups:
        known |= set(table.all_columns(summary.sections(places)))
    for column in columns:
        if column not in known:
            near = difflib.get_close_matches(column, known, 3, 0.5) or sorted(known)[:6]
            raise BenchError(
                f"no result has one number per case or set called {column!r}; there are {', '.join(near)}"
            )


def tables(places: Sequence[Place], sections: Sequence[Section], columns: Sequence[str]) -> list[Table]:
    """The tables of one task on one data set. columns: those that it does not have are left out."""
    task = places[0].task.split("-")[0]
    there = set(table.all_columns(sections))
    wanted = [column for column in columns if column in there]
    by: By | None = BY[task] if task in DERIVED and task != "reconstruct" else None
    if by is not None:  # neither speeds nor values of sets are known by parts
        wanted = [column for column in wanted if column not in (FPS, *set_groups.declared(sections))]
    if not wanted:
        return task_tables(places, task) if task in DERIVED else table.tables(sections, with_sets=True)
    if by is None and not set(wanted) - {FPS, *set_groups.declared(sections)}:
        mains = (placing.main_value(each, task) for each in panel.panels(places))
        wanted = [*dict.fromkeys(main for main in mains if main is not None), *wanted]
    return table.tables(summary.sections(places, by) if by else sections, wanted, by or "")
