"""Tables by request, on the command line or in Python."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

from retarget_bench.analysis.breakdown import By
from retarget_bench.analysis.selection import PEOPLE, Selection, group_of_bodies
from retarget_bench.analysis.summary import SplitSummary, split_summaries
from retarget_bench.api import PAIRED
from retarget_bench.errors import BenchError
from retarget_bench.options import Names, OfBodies, OfMethods, listed, option
from retarget_bench.results.metres import UNITS
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import builder, names
from retarget_bench.tables.cells import FPS
from retarget_bench.tables.model import Table, count

LAYOUTS: dict[str, builder.Layout] = {"html": "both", "csv": "splits", "json": "splits"}
"""Format -> the layout of a table of the usual columns; of others all splits side by side."""
TASK_COLUMNS = {
    "reconstruct": ("restored_cm", "jerk_ratio"),
    "denoise": ("restored_cm", "jerk_ratio"),
    "joint-completion": ("restored_cm", "restored_cm.missing"),
}
"""Derived task -> its default columns."""
TASK_BREAKDOWN: dict[str, By] = {
    "reconstruct": "structure",
    "denoise": "level",
    "joint-completion": "level",
}
"""Derived task -> its default breakdown, since a mean over levels says little."""


class Request(OfMethods, OfBodies):
    """A choice of columns, cases and methods. Raises BenchError for values that it cannot have."""

    columns: Names = option(
        "Value ids to show (bench info METRIC lists them), or names of values.",
        default=(),
        shown="the usual ones",
        metavar="ID,ID",
        kw_only=False,
    )
    all: bool = option("Show every value.", default=False)
    splits: Names = option(
        "Splits, such as cross, with more columns.",
        default=(),
        shown="all side by side",
        letter="s",
        metavar="SPLIT",
    )
    by: By | Literal[""] = option(
        "Break values down: a line per pair, clip, kind of performance, structure, level of a task, joint, "
        "part of the body, by what was seen in training, or per point of a curve. Without columns: the "
        "first value that there is.",
        default="",
    )
    at_least: int | None = option(
        "Only clips that last so many seconds.", default=None, at_least=1, metavar="SECONDS"
    )
    against: Literal["", "source"] = option(
        "Show the values against the source instead of those against the reference.", default=""
    )
    unit: Literal["", "m"] = option("Show metres instead of per cent of the target's height.", default="")
    variants: bool = option("Show variants of methods, too.", default=False)
    no_controls: bool = option("Leave out controls.", default=False)

    def selection(self, task: str) -> Selection:
        """The methods, of results of a task: of tasks of one body all variants, and bodies together."""
        paired = task in PAIRED
        return Selection(
            listed(self.methods), self.variants or not paired, not self.no_controls, apart=paired
        )

    def summaries(self, places: Sequence[ResultPaths], by: By | None) -> list[SplitSummary]:
        """The numbers that tables are made of."""
        select = self.selection(places[0].kind)
        return split_summaries(places, by, self.at_least, select=select, metres=self.unit == "m")


def tables(places: Sequence[ResultPaths], request: Request, form: str = "text") -> list[Table]:
    """The tables of results of one task, laid out for a format.

    Raises BenchError for columns, bodies and splits that no result has.
    """
    by, task = request.by or None, places[0].kind
    requested_columns, splits = listed(request.columns), listed(request.splits)
    usual = not requested_columns and not request.all
    plain = request.at_least is None and not (request.against or request.unit)
    if task in TASK_COLUMNS and usual and plain:
        return task_tables(places, task, by, request.selection(task))
    if task in TASK_COLUMNS and requested_columns and task != "reconstruct":
        by = by or TASK_BREAKDOWN[task]
    sections = request.summaries(places, by)
    columns: Sequence[str] | None = None
    if request.all:
        # nobody times probes, nor derived tasks
        columns = [each for each in builder.all_columns(sections) if task in PAIRED or each != FPS]
    elif requested_columns:
        columns = names.column_ids(requested_columns, sections)
        if by is None and (over := builder.curve_index(sections, columns)):
            by, sections = over, request.summaries(places, over)
    shown, hints = _shown(sections, request)
    if request.at_least is not None:
        hints.append(f"Only clips of {request.at_least} s or longer.")
    layout: builder.Layout = LAYOUTS.get(form, "overview")
    if by or splits or task not in PAIRED or (layout == "both" and not usual):
        layout = "splits"
    if request.against:
        shown_beside = builder.OVERVIEW_COLUMNS if layout == "overview" else builder.DEFAULT_COLUMNS
        beside = shown_beside if columns is None else columns
        columns = names.against_the_source(beside, sections, explicit=bool(requested_columns))
        columns = columns[: 1 if usual and by else None]
        layout = "splits" if layout == "both" else layout
    made = builder.tables(shown, columns, by or "", layout=layout)
    for place, table in enumerate(made):
        units = {column.unit for column in (*table.columns, *table.subjects)}
        if request.unit and units & set(UNITS.values()):  # ids say per cent of the height; CSV has no units
            made[place] = replace(table, title=f"{table.title} in metres")
    return [*made[:-1], *(replace(last, hints=(*last.hints, *hints)) for last in made[-1:])]


def task_tables(
    places: Sequence[ResultPaths], task: str, by: By | None = None, select: Selection | None = None
) -> list[Table]:
    """The tables of a task: by level or structure, or whatever else is asked for; of ``reconstruct`` also
    one over all structures."""
    both = by is None and TASK_BREAKDOWN[task] == "structure"
    by = by or TASK_BREAKDOWN[task]
    parts = split_summaries(places, by, select=select)
    there = {key for section in parts for key in section.values}
    columns = [key for key in TASK_COLUMNS[task] if key in there]
    return [
        *(builder.tables(split_summaries(places, select=select), columns or None) if both else []),
        *builder.tables(parts, columns[: 1 if both else None] or None, by),
    ]


def _shown(sections: Sequence[SplitSummary], request: Request) -> tuple[list[SplitSummary], list[str]]:
    """The sections of these bodies (``selection.group_of_bodies``) and splits, and sentences about what is
    left out.

    Raises BenchError where there are none.
    """
    group = group_of_bodies([section.bodies for section in sections], request.bodies)
    of_group = [section for section in sections if group in ("all", section.bodies)]
    cases = Counter[str]()
    for section in sections:
        if group not in ("all", section.bodies):
            cases[section.bodies] += max(score.asked for score in section.scores)
    variants = {label for section in of_group for label in section.variants}
    left = [*others(cases), *([f"{count(len(variants), 'variant')} (--variants)"] if variants else [])]
    splits = listed(request.splits)
    chosen = [section for section in of_group if not splits or section.split in splits]
    if of_group and not chosen:
        bodies = f" of {request.bodies} bodies" if request.bodies not in ("", "all") else ""
        there = " and ".join(dict.fromkeys(section.split for section in of_group))
        raise BenchError(f"no case{bodies} is in the split {' or '.join(splits)}; {there} have some")
    return chosen, [f"Not shown: {', '.join(left)}."] if left else []


def others(cases: Mapping[str, int]) -> list[str]:
    """Groups of bodies that are left out, with their numbers of cases and the option that shows them."""
    return [
        f"{group if group == PEOPLE else f'{group} bodies'} ({count(number, 'case')}, --bodies {group})"
        for group, number in cases.items()
    ]
