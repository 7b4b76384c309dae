"""The chapters of a report, one per task and data set, and their tables."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from retarget_bench.analysis import ranking, statistics, summary
from retarget_bench.analysis.breakdown import UNKNOWN, By
from retarget_bench.analysis.selection import BODIES, Selection, of_dataset
from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.api import PAIRED, TASKS
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.tasks import DERIVED, definitions
from retarget_bench.figures import method_order
from retarget_bench.motion.character import Character
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import case_metadata, dataset_names, result_matrix
from retarget_bench.results.result_matrix import ResultMatrix
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import builder, names, requested
from retarget_bench.tables.cells import FPS, declared_sets
from retarget_bench.tables.model import Column, Table
from retarget_bench.viewer.scene_builder import Over

_BODIES = ("", *BODIES)


@dataclass(frozen=True)
class Split:
    """One split of a chapter.

    matrix:   its own cases; methods in the order of the chapter.
    main:     the value that its cases are ordered by. values: those that have a number per case in the
              tables, the main one first. decimals: value id -> with how many its column is written.
    """

    matrix: ResultMatrix
    section: SplitSummary
    main: Column
    values: tuple[Column, ...]
    decimals: Mapping[str, int]

    @property
    def name(self) -> str:
        return self.matrix.split

    @property
    def labels(self) -> list[str]:
        return [row.label for row in self.matrix.rows]

    @property
    def digits(self) -> int:
        """Decimals of the main value."""
        return self.decimals.get(self.main.id, 2)

    @cached_property
    def ranked(self) -> np.ndarray:
        """``(methods,)`` bool."""
        return np.array([not ranking.unranked(row.header) for row in self.matrix.rows])

    @cached_property
    def losses(self) -> np.ndarray:
        """``(methods, cases)``: how bad the main value is, as far as it is known at all."""
        numbers = self.matrix.numbers((self.main.id, ""))
        return statistics.losses(numbers, self.main.better, self.main.goal)

    @cached_property
    def groups(self) -> dict[str, list[str]]:
        """Grouping (kind, pair, clip, ...) -> the group of every case."""
        cases = self.matrix.cases
        groups = {
            "kind": [info.kind or UNKNOWN for info in cases],
            "pair": [info.pair for info in cases],
            "clip": [info.clip for info in cases],
        }
        structures: dict[str, str] = {}
        conditions: dict[str, Mapping[str, float]] = {}
        for row in self.matrix.rows:
            structures |= case_metadata.read(row.paths).structures
            conditions |= case_metadata.read(row.paths).conditions
        groups["structure"] = [structures.get(info.target, UNKNOWN) for info in cases]
        if conditions:
            groups["level"] = [definitions.level_name(conditions.get(info.id, {})) for info in cases]
        return groups


@dataclass(frozen=True)
class Chapter:
    """Results of one task (a folder's name, ``denoise-1a2b3c4d`` where it has parameters) on a data set.

    title: of its tables: the data set's label, which names derived tasks too, and the group of bodies.
    data: the spec of the data set.
    """

    task: str
    title: str
    data: Spec
    places: tuple[ResultPaths, ...]
    tables: tuple[Table, ...]
    splits: tuple[Split, ...]

    @property
    def kind(self) -> str:
        """The task without its parameters."""
        return next(task for task in TASKS if self.task.startswith(task))

    @property
    def labels(self) -> list[str]:
        return list(dict.fromkeys(label for split in self.splits for label in split.labels))

    @cached_property
    def bodies(self) -> Mapping[str, Character] | BenchError:
        """The characters of the data set, or the reason why it is not here."""
        try:
            return bound.dataset(self.data).built.characters()
        except BenchError as error:
            return error


def chapters(
    roots: Sequence[Path],
    task: str | None = None,
    dataset: str | None = None,
    methods: Sequence[str] = (),
    data: str | None = None,
    columns: Sequence[str] = (),
    only: Collection[ResultPaths] = (),
    variants: bool = False,
    over: Over = iter,
) -> list[Chapter]:
    """A chapter per task and data set, retargeting first.

    task, dataset (see ``of_dataset``), methods: only of these. data: the folder where the data lie.
    columns: of the tables, where a chapter has them, instead of the usual ones. only: of these results.
    variants: variants of methods are shown, too; they are where methods are named.
    Raises BenchError where a root has no results, and where nothing is left.
    """
    all_places = results(roots)
    chosen = [place for place in all_places if task is None or place.kind == task]
    chosen = chosen if dataset is None else of_dataset(chosen, dataset)
    chosen = [place for place in chosen if not only or place in only]
    if not chosen:
        there = sorted({f"{place.task} on {place.dataset}" for place in all_places})
        raise BenchError(f"no such results here; there are those of {', '.join(there)}")
    if methods:
        by_methods = method_order.of_methods(chosen, methods)
        chosen = [place for place in chosen if place in by_methods]
    groups = method_order.apart(chosen)
    columns = _column_ids(groups, columns)
    variants = variants or bool(methods)
    names = dataset_names.shown(dataset_names.headers(chosen))
    made = [
        chapter
        for places in over(groups)
        for chapter in _chapters(places, names[places[0]], data, columns, variants)
    ]
    if not made:
        raise BenchError("no result here has a number; bench table says why cases have no answer")
    return made


def results(roots: Sequence[Path]) -> list[ResultPaths]:
    """All that there are, of all tasks. Raises BenchError where a root has none."""
    places: list[ResultPaths] = []
    for root in roots:
        here = method_order.everything([root])
        if not here:
            raise BenchError(f"no results in {root}; bench run --out {root} makes some")
        places += here
    return places


def _chapters(
    places: Sequence[ResultPaths], name: str, data: str | None, columns: Sequence[str], variants: bool
) -> list[Chapter]:
    """A chapter for each group of bodies; those of derived tasks are not told apart.

    name: what tables call the data set.
    """
    retargeted = places[0].kind in PAIRED
    matrices = [replace(each, dataset=name) for each in result_matrix.result_matrices(places)]
    selection = Selection(variants=variants or not retargeted, apart=retargeted)
    by_bodies: dict[str, list[ResultMatrix]] = {}
    for matrix in selection.parts(matrices):
        by_bodies.setdefault(matrix.bodies, []).append(matrix)
    chapters = (
        _chapter(places, by_bodies[name], data, columns) for name in sorted(by_bodies, key=_BODIES.index)
    )
    return [chapter for chapter in chapters if chapter is not None]


def _chapter(
    places: Sequence[ResultPaths],
    matrices: Sequence[ResultMatrix],
    data: str | None,
    columns: Sequence[str],
) -> Chapter | None:
    """None where no result declares a number per case, so that there is nothing to show."""
    sections = [summary.split_summary(matrix) for matrix in matrices]
    tables = _tables(places, sections, columns)
    section_of = {section.split: section for section in sections}
    shown = {each.split: columns_of for each in matrices if (columns_of := _columns(tables, each))}
    if usual := _usual(tables, shown):
        shown |= {each.split: [usual] for each in matrices if each.split not in shown and each.own.any()}
    order = method_order.order(sections, {split: columns[0].id for split, columns in shown.items()})
    splits = tuple(
        Split(
            _ordered(each, order),
            section_of[each.split],
            shown[each.split][0],
            tuple(shown[each.split]),
            _decimals(tables),
        )
        for each in matrices
        if each.split in shown
    )
    if not splits:
        return None
    declared = splits[0].matrix.rows[0].header.dataset
    spec = Spec(declared.name, declared.parameters)
    spec = spec if data is None else spec.with_parameters(root=data)
    return Chapter(places[0].task, tables[0].title, spec, tuple(places), tuple(tables), splits)


def _columns(tables: Sequence[Table], split: ResultMatrix) -> list[Column]:
    """The values with a number per case that the tables of a split show."""
    columns: dict[str, Column] = {}
    for each in tables:
        column_of = {column.id: column for column in each.explained}
        for group in each.groups:
            ids = [group.subject] if group.subject else [column.id for column in group.columns]
            if group.split == split.split and not group.structure:
                columns |= {key: column_of[key] for key in ids if key != FPS}
    return [column for column in columns.values() if (column.id, "") in split.keys]


def _usual(tables: Sequence[Table], shown: Mapping[str, Sequence[Column]]) -> Column | None:
    """The column for a split without any number: the main one of other splits, or the first."""
    mains = [columns[0] for columns in shown.values()]
    declared = [each for table in tables for each in table.explained]
    return next((each for each in (*mains, *declared) if each.id != FPS), None)


def _decimals(tables: Sequence[Table]) -> dict[str, int]:
    decimals: dict[str, int] = {}
    for each in tables:
        for group in each.groups:
            for row in group.rows:
                for column, cell in zip(group.columns, row.cells, strict=True):
                    if cell.value is not None:
                        decimals.setdefault(group.subject or column.id, cell.decimals)
    return decimals


def _ordered(matrix: ResultMatrix, order: Sequence[str]) -> ResultMatrix:
    """A matrix of its own cases, with its methods in this order."""
    own = matrix.restricted(matrix.own, "")
    return replace(own, rows=tuple(sorted(own.rows, key=lambda row: order.index(row.label))))


# ------------------------------------------------------------------------------------------------ tables
def _column_ids(groups: Sequence[Sequence[ResultPaths]], columns: Sequence[str]) -> Sequence[str]:
    """The ids of these columns. Raises BenchError for one that no results of any chapter have."""
    if not columns:
        return ()
    sections = [each for places in groups for each in summary.split_summaries(places)]
    ids = names.column_ids(columns, sections)
    if curve := next((each for each in ids if each not in builder.all_columns(sections)), None):
        raise BenchError(f"{curve} is a curve, and columns have one number per case or set")
    return ids


def _tables(
    places: Sequence[ResultPaths], sections: Sequence[SplitSummary], columns: Sequence[str]
) -> list[Table]:
    """The tables of one task on one data set. columns: those that it does not have are left out."""
    task = places[0].kind
    there = set(builder.all_columns(sections))
    shown = [column for column in columns if column in there]
    by: By | None = requested.TASK_BREAKDOWN[task] if task in DERIVED and task != "reconstruct" else None
    if by is not None:  # neither speeds nor values of sets are known by parts
        shown = [column for column in shown if column not in (FPS, *declared_sets(sections))]
    if not shown:
        standard = task not in DERIVED
        if standard:
            layout: builder.Layout = "both" if len(sections) > 1 else "splits"
            return builder.tables(sections, with_sets=True, layout=layout)
        return requested.task_tables(places, task)
    if by is None and not set(shown) - {FPS, *declared_sets(sections)}:
        mains = (method_order.main_value(each, task) for each in result_matrix.result_matrices(places))
        shown = [*dict.fromkeys(main for main in mains if main is not None), *shown]
    return builder.tables(summary.split_summaries(places, by) if by else sections, shown, by or "")
