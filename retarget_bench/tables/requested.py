"""The tables that somebody asks for, on the command line or in Python."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from retarget_bench.analysis.breakdown import By
from retarget_bench.analysis.selection import Selection
from retarget_bench.analysis.summary import SplitSummary, split_summaries
from retarget_bench.api import PAIRED
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.tasks import DERIVED
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import body_groups, builder, names
from retarget_bench.tables.groups import FPS
from retarget_bench.tables.model import Table

LAYOUTS: dict[str, builder.Layout] = {"text": "overview", "md": "overview", "html": "both"}
"""Format -> the layout of a table for which nothing special is asked; of others a group per split."""

MOST_BESIDE = len(builder.OVERVIEW_COLUMNS)
"""Requested columns up to which splits stand side by side, as they do without a request."""


@dataclass(frozen=True)
class Request:
    """A choice of columns, cases and methods.

    columns:  names of columns; None: the usual ones. everything: all of them.
    by:       a breakdown; None: none.
    at_least: only of cases that last so many seconds. splits: only these; none: all.
    bodies:   see ``body_groups.shown``. select: of methods.
    """

    columns: Sequence[str] | None = None
    everything: bool = False
    by: By | None = None
    at_least: int | None = None
    splits: Sequence[str] = ()
    bodies: str = ""
    select: Selection = field(default_factory=Selection)


def tables(places: Sequence[ResultPaths], asked: Request, form: str = "text") -> list[Table]:
    """The tables of results of one task, laid out for a format.

    Raises BenchError for columns, bodies and splits that no result has.
    """
    by, task = asked.by, places[0].task.split("-")[0]
    usual = asked.columns is None and not asked.everything
    if task in DERIVED and usual and asked.at_least is None:
        return builder.task_tables(places, task, by, asked.select)
    if task in DERIVED and asked.columns is not None and task != "reconstruct":
        by = by or builder.TASK_BREAKDOWN[task]
    found = split_summaries(places, by, asked.at_least, select=asked.select)
    columns: Sequence[str] = builder.DEFAULT_COLUMNS
    if asked.everything:
        # nobody times probes, nor derived tasks
        columns = [each for each in builder.all_columns(found) if task in PAIRED or each != FPS]
    elif asked.columns is not None:
        columns = names.column_ids(asked.columns, found, _shown(found, asked)[0])
        if by is None and (over := builder.curve_index(found, columns)):
            by, found = over, split_summaries(places, over, asked.at_least, select=asked.select)
    shown, hints = _shown(found, asked)
    if asked.at_least is not None:
        hints.append(f"only clips of {asked.at_least} s or longer")
    layout: builder.Layout = "splits"
    few = asked.columns is not None and len(columns) <= MOST_BESIDE
    if few and form in ("text", "md") and not (by or asked.splits):
        layout = "overview"
    if task in PAIRED and usual and not (by or asked.splits):
        layout = LAYOUTS.get(form, "splits")
        columns = builder.OVERVIEW_COLUMNS if form == "tex" else columns
    return builder.with_hints(builder.tables(shown, columns, by or "", layout=layout), hints)


def _shown(found: Sequence[SplitSummary], asked: Request) -> tuple[list[SplitSummary], list[str]]:
    """The sections of these bodies and splits, and sentences about bodies that are left out.

    Raises BenchError where there are none.
    """
    shown, hints = body_groups.shown(found, asked.bodies)
    kept = [each for each in shown if not asked.splits or each.split in asked.splits]
    if shown and not kept:
        bodies = f" of {asked.bodies} bodies" if asked.bodies not in ("", "all") else ""
        there = " and ".join(dict.fromkeys(section.split for section in shown))
        raise BenchError(f"no case{bodies} is in the split {' or '.join(asked.splits)}; {there} have some")
    return kept, hints
