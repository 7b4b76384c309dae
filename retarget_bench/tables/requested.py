"""The tables that somebody asks for, on the command line or in Python."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

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
    against:  ``source``: values against the source, where they exist, in the place of those against the
              reference. unit: ``m``: values in per cent of the height in metres. "": as they are.
    """

    columns: Sequence[str] | None = None
    everything: bool = False
    by: By | None = None
    at_least: int | None = None
    splits: Sequence[str] = ()
    bodies: str = ""
    select: Selection = field(default_factory=Selection)
    against: Literal["", "source"] = ""
    unit: Literal["", "m"] = ""

    def summaries(self, places: Sequence[ResultPaths], by: By | None) -> list[SplitSummary]:
        """The numbers that tables are made of."""
        return split_summaries(places, by, self.at_least, select=self.select, metres=self.unit == "m")


def tables(places: Sequence[ResultPaths], asked: Request, form: str = "text") -> list[Table]:
    """The tables of results of one task, laid out for a format.

    Raises BenchError for columns, bodies and splits that no result has.
    """
    by, task = asked.by, places[0].task.split("-")[0]
    usual = asked.columns is None and not asked.everything
    plain = asked.at_least is None and not (asked.against or asked.unit)
    if task in DERIVED and usual and plain:
        return builder.task_tables(places, task, by, asked.select)
    if task in DERIVED and asked.columns is not None and task != "reconstruct":
        by = by or builder.TASK_BREAKDOWN[task]
    found = asked.summaries(places, by)
    columns: Sequence[str] = builder.DEFAULT_COLUMNS
    if asked.everything:
        # nobody times probes, nor derived tasks
        columns = [each for each in builder.all_columns(found) if task in PAIRED or each != FPS]
    elif asked.columns is not None:
        columns = names.column_ids(asked.columns, found)
        if by is None and (over := builder.curve_index(found, columns)):
            by, found = over, asked.summaries(places, over)
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
    if asked.against:
        beside = builder.OVERVIEW_COLUMNS if usual and layout == "overview" else columns
        columns = names.against_the_source(beside, found, asked=asked.columns is not None)
        columns = columns[: 1 if usual and by else None]
        layout = "splits" if layout == "both" else layout
    made = builder.tables(shown, columns, by or "", layout=layout)
    if asked.unit:  # ids say per cent of the height, and CSV has no units
        made = [replace(table, title=f"{table.title} in metres") for table in made]
    return builder.with_hints(made, hints)


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
