"""The tables that somebody asks for, on the command line or in Python."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from retarget_bench.analysis.breakdown import By
from retarget_bench.analysis.selection import PEOPLE, Selection, wanted_group
from retarget_bench.analysis.summary import SplitSummary, split_summaries
from retarget_bench.api import PAIRED
from retarget_bench.errors import BenchError
from retarget_bench.results.metres import UNITS
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import builder, names
from retarget_bench.tables.groups import FPS
from retarget_bench.tables.model import Table, count

LAYOUTS: dict[str, builder.Layout] = {"html": "both", "csv": "splits", "json": "splits"}
"""Format -> the layout of a table of the usual columns; of others all splits side by side."""
TASK_COLUMNS = {
    "reconstruct": ("restored_cm", "jerk_ratio"),
    "denoise": ("restored_cm", "jerk_ratio"),
    "upsample": ("restored_cm", "restored_cm.missing"),
}
"""Derived task -> its default columns."""
TASK_BREAKDOWN: dict[str, By] = {"reconstruct": "structure", "denoise": "level", "upsample": "level"}
"""Derived task -> its default breakdown, since a mean over levels says little."""


@dataclass(frozen=True)
class Request:
    """A choice of columns, cases and methods.

    columns:  names of columns; None: the usual ones. everything: all of them.
    by:       a breakdown; None: none.
    at_least: only of cases that last so many seconds. splits: only these; none: all.
    bodies:   see ``selection.wanted_group``. select: of methods.
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
    if task in TASK_COLUMNS and usual and plain:
        return task_tables(places, task, by, asked.select)
    if task in TASK_COLUMNS and asked.columns is not None and task != "reconstruct":
        by = by or TASK_BREAKDOWN[task]
    found = asked.summaries(places, by)
    columns: Sequence[str] | None = None
    if asked.everything:
        # nobody times probes, nor derived tasks
        columns = [each for each in builder.all_columns(found) if task in PAIRED or each != FPS]
    elif asked.columns is not None:
        columns = names.column_ids(asked.columns, found)
        if by is None and (over := builder.curve_index(found, columns)):
            by, found = over, asked.summaries(places, over)
    shown, hints = _shown(found, asked)
    if asked.at_least is not None:
        hints.append(f"Only clips of {asked.at_least} s or longer.")
    layout: builder.Layout = LAYOUTS.get(form, "overview")
    if by or asked.splits or task not in PAIRED or (layout == "both" and not usual):
        layout = "splits"
    if asked.against:
        shown_beside = builder.OVERVIEW_COLUMNS if layout == "overview" else builder.DEFAULT_COLUMNS
        beside = shown_beside if columns is None else columns
        columns = names.against_the_source(beside, found, asked=asked.columns is not None)
        columns = columns[: 1 if usual and by else None]
        layout = "splits" if layout == "both" else layout
    made = builder.tables(shown, columns, by or "", layout=layout)
    if asked.unit:  # ids say per cent of the height, and CSV has no units
        made = [_titled(table) for table in made]
    return [*made[:-1], *(replace(last, hints=(*last.hints, *hints)) for last in made[-1:])]


def _titled(table: Table) -> Table:
    """A table that says so where any of its values is in metres."""
    units = {column.unit for column in (*table.columns, *table.subjects)}
    return replace(table, title=f"{table.title} in metres") if units & set(UNITS.values()) else table


def task_tables(
    places: Sequence[ResultPaths], task: str, by: By | None = None, select: Selection | None = None
) -> list[Table]:
    """The tables of a task: by level or structure, or whatever else is asked for; of ``reconstruct`` also
    one over all structures."""
    both = by is None and TASK_BREAKDOWN[task] == "structure"
    whole = split_summaries(places, select=select) if both else []
    by = by or TASK_BREAKDOWN[task]
    parts, wanted = split_summaries(places, by, select=select), TASK_COLUMNS[task]
    return [
        *builder.tables(whole, _known_columns(whole, wanted)),
        *builder.tables(parts, _known_columns(parts, wanted[: 1 if whole else None]), by),
    ]


def _known_columns(found: Sequence[SplitSummary], wanted: Sequence[str]) -> Sequence[str] | None:
    """Those that any result has; None, the usual ones of all tables, where none has."""
    there = {key for section in found for key in section.values}
    return tuple(key for key in wanted if key in there) or None


def _shown(found: Sequence[SplitSummary], asked: Request) -> tuple[list[SplitSummary], list[str]]:
    """The sections of these bodies and splits, and sentences about what is left out.

    Raises BenchError where there are none.
    """
    shown, hints = of_bodies(found, asked.bodies)
    kept = [each for each in shown if not asked.splits or each.split in asked.splits]
    if shown and not kept:
        bodies = f" of {asked.bodies} bodies" if asked.bodies not in ("", "all") else ""
        there = " and ".join(dict.fromkeys(section.split for section in shown))
        raise BenchError(f"no case{bodies} is in the split {' or '.join(asked.splits)}; {there} have some")
    return kept, hints


# ---------------------------------------------------------------------------------------------- bodies
def of_bodies(found: Sequence[SplitSummary], bodies: str) -> tuple[list[SplitSummary], list[str]]:
    """The sections of a group of bodies (``selection.wanted_group``), and sentences about what is left
    out."""
    wanted = wanted_group([section.bodies for section in found], bodies)
    kept = [section for section in found if wanted in ("all", section.bodies)]
    cases: dict[str, int] = {}
    for section in found if wanted != "all" else ():
        if section.bodies != wanted:
            asked = max(score.asked for score in section.scores)
            cases[section.bodies] = cases.get(section.bodies, 0) + asked
    variants = dict.fromkeys(label for section in kept for label in section.variants)
    left = [*others(cases), *([f"{count(len(variants), 'variant')} (--variants)"] if variants else [])]
    return kept, [f"Not shown: {', '.join(left)}."] if left else []


def others(cases: Mapping[str, int]) -> list[str]:
    """Groups of bodies that are left out, with their numbers of cases and the option that shows them."""
    return [
        f"{group if group == PEOPLE else f'{group} bodies'} ({count(number, 'case')}, --bodies {group})"
        for group, number in cases.items()
    ]
