"""Published tables and our own results in their columns.

``published/*.toml`` hold the printed numbers. Each column names our value of the same protocol and the
pairs it is a mean over, or why there is none.
"""

import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from retarget_bench import defaults
from retarget_bench.analysis.summary import never_ranked
from retarget_bench.api import CaseInfo, optional
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import case_metadata, columns, compatibility, store
from retarget_bench.results.columns import Columns
from retarget_bench.results.header import MethodInfo, ResultHeader
from retarget_bench.results.store import ResultPaths

FLOOR, FLOOR_MARK = "floor", "real motion against real motion"
OUR_STRUCTURES = "structures of these results"
UNTRAINED = "the method is untrained, so no structure is seen or unseen"


class _Facts(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PublishedColumn(_Facts):
    """One column as printed.

    value:    our value of the same protocol, or "".
    pairs:    ``source>target`` of the cases that it is a mean over.
    any_pair: a mean over every pair that is no self pair, of whatever data. splits: likewise, over all
              cases of these splits.
    mean_of:  columns that it is the mean of.
    seen:     a mean over all target structures that training had (``seen``) or had not (``unseen``).
    structure: a mean over all bodies of a structure.
    legs, kind: of values of sets of answers: the legs of the targets, and the kind of the cases ("": all).
    block:    columns of one block are drawn together.
    missing:  why we have no number for it, or "".
    """

    id: str
    label: str
    unit: str
    value: str = ""
    pairs: tuple[str, ...] = ()
    any_pair: bool = False
    splits: tuple[str, ...] = ()
    mean_of: tuple[str, ...] = ()
    seen: str = ""
    structure: str = ""
    legs: int = 0
    kind: str = ""
    block: str = ""
    missing: str = ""


class PublishedRow(_Facts):
    """One method as printed: column -> (number,) or (number, spread)."""

    method: str
    values: Mapping[str, tuple[float, ...]]


class PublishedTable(_Facts):
    """``clips``: how many test clips the paper has (0: its test set is another one). ``task``: whose
    results answer to it."""

    title: str
    paper: str
    clips: int
    task: str = "retarget"
    notes: tuple[str, ...]
    columns: tuple[PublishedColumn, ...]
    rows: tuple[PublishedRow, ...] = Field(min_length=1)

    @property
    def of_sets(self) -> bool:
        """It compares sets of answers with real motion, and not answers with right ones."""
        return any(column.legs for column in self.columns)


@dataclass(frozen=True)
class OwnCell:
    """Our number for a column: mean over clips of the mean per clip, and spread over cases.

    cases, clips, pairs: what it is a mean over. Of sets: windows in each, clips, and structures of targets.
    """

    value: float
    spread: float
    cases: int
    clips: int
    pairs: int


@dataclass(frozen=True)
class OwnRow:
    """One method of ours on one data set: column -> cell, where it has any; reasons: why it has none.

    variant: which variant of a published method it is, or "".
    """

    label: str
    dataset: str
    name: str
    mark: str
    cells: Mapping[str, OwnCell]
    reasons: Mapping[str, str] = field(default_factory=dict)
    variant: str = ""


_FOLDER = files("retarget_bench.tables.published")


def names() -> list[str]:
    """The published tables there are."""
    return sorted(each.name[:-5] for each in _FOLDER.iterdir() if each.name.endswith(".toml"))


@cache
def published(name: str) -> PublishedTable:
    """A published table. Raises BenchError for a name that there is none of."""
    if name not in names():
        raise BenchError(f"there is no published table {name!r}; there are {', '.join(names())}")
    text = (_FOLDER / f"{name}.toml").read_text(encoding="utf-8")
    return PublishedTable.model_validate(tomllib.loads(text))


def with_structures(table: PublishedTable, places: Sequence[ResultPaths]) -> PublishedTable:
    """A table by structures, with a further block: our own structures, and a note per trained method that
    says which of them it knew. The value is that of the columns by what was seen."""
    value, unit = next((column.value, column.unit) for column in table.columns if column.seen)
    found: set[str] = set()
    notes: dict[str, None] = {}
    for place in places:
        mine = set((case_metadata.read_structures(place) or {}).values())
        found |= mine
        method = store.read_header(place.header).method
        if trained := method.trained_on:
            known = mine & set(trained.get("structures", ()))
            told = [", ".join(sorted(each)) or "none" for each in (known, mine - known)]
            notes[f"{method.label}: trained on structures {told[0]}; new to it: {told[1]}."] = None
    ours = tuple(
        PublishedColumn(id=name, label=name, unit=unit, value=value, structure=name, block=OUR_STRUCTURES)
        for name in sorted(found)
    )
    return table.model_copy(update={"columns": (*table.columns, *ours), "notes": (*table.notes, *notes)})


def own_rows(table: PublishedTable, places: Sequence[ResultPaths]) -> list[OwnRow]:
    """Our methods in the columns of a published table: those that have a number in any of them.

    Numbers on other data, or of another version of a metric, than the newest are left out, as in every
    table. Raises FileError where a result cannot be read.
    """
    if table.of_sets:
        return _own_set_rows(table, places)
    there = [(place, store.read_header(place.header)) for place in dict.fromkeys(places)]
    newest = compatibility.newest_by_label(header for _, header in there)
    grouped: dict[tuple[str, str, Path], list[Columns]] = {}
    for place, header in there:
        dataset = header.dataset.label
        found = columns.read(place, header, newest[dataset])
        grouped.setdefault((dataset, header.method.label, place.root), []).append(found)
    names = Counter((dataset, label) for dataset, label, _ in grouped)
    rows = [
        _own_row(table, dataset, label if names[dataset, label] == 1 else f"{label} ({root})", mine)
        for (dataset, label, root), mine in grouped.items()
    ]
    return [row for row in rows if row.cells]


def _own_row(table: PublishedTable, dataset: str, label: str, found: Sequence[Columns]) -> OwnRow:
    header = found[0].header
    numbers = _numbers(found)
    theirs = header.dataset.name == defaults.PAPERS_DATASET
    structures = case_metadata.read_structures(found[0].paths) or {}
    trained = header.method.trained_on
    asked = {
        column.id: [
            each
            for each in numbers.get(column.value, ())
            if _asked(column, each[0], structures.get(each[0].target, ""), trained)
        ]
        for column in table.columns
        if theirs or column.any_pair or column.splits or column.seen or column.structure
    }
    cells: dict[str, OwnCell] = {}
    for column in table.columns:
        if parts := [cells[each] for each in column.mean_of if each in cells]:
            # the mean of means, as the papers take it; all else is of all cases together
            whole = _mean([each for part in column.mean_of for each in asked[part]])
            cells[column.id] = replace(whole, value=float(np.mean([part.value for part in parts])))
        elif asked.get(column.id):
            cells[column.id] = _mean(asked[column.id])
    reasons = {} if trained else {column.id: UNTRAINED for column in table.columns if column.seen}
    mark = never_ranked(header.method)
    return OwnRow(label, dataset, header.dataset.name, mark, cells, reasons, variant(header.method))


def variant(method: MethodInfo) -> str:
    """Variant of a published method, by its card: ``as published``, ``ours: ...``, or of a
    method without a paper, what distinguishes it. "" where the label says it, or it is not installed."""
    given = {name: value for name, value in method.parameters.items() if name != "weights"}
    try:
        card = optional.method_card(registry.create("methods", Spec(method.name, given)))
    except BenchError:
        return ""
    if not card.paper:
        return "" if given else card.differs
    if any(given == each for each in card.published):
        return "as published"
    return "ours, with these settings" if given else f"ours: {card.differs}" if card.differs else "ours"


def _numbers(found: Sequence[Columns]) -> dict[str, list[tuple[CaseInfo, float]]]:
    """Value id -> the numbers of all cases of all splits, each the mean over the seeds there are."""
    seeds: dict[str, dict[str, list[float]]] = {}
    infos = {info.id: info for each in found for info in each.cases}
    for each in found:
        for (value, index), column in each.numbers.items():
            for info, number in zip(each.cases, column.tolist(), strict=True):
                if not index and not np.isnan(number):
                    seeds.setdefault(value, {}).setdefault(info.id, []).append(number)
    return {
        value: [(infos[case], float(np.mean(numbers))) for case, numbers in cases.items()]
        for value, cases in seeds.items()
    }


def _asked(
    column: PublishedColumn, info: CaseInfo, structure: str, trained: Mapping[str, Sequence[str]] | None
) -> bool:
    """trained: what a method's weights were trained on; None where it is not trained."""
    if column.structure:
        return structure == column.structure
    if column.seen:
        had = trained is not None and structure in trained.get("structures", ())
        return trained is not None and had == (column.seen == "seen")
    if column.splits:
        return info.split in column.splits
    return info.split != "self" if column.any_pair else info.pair in column.pairs


def _mean(found: Sequence[tuple[CaseInfo, float]]) -> OwnCell:
    by_clip: dict[str, list[float]] = {}
    for info, number in found:
        by_clip.setdefault(info.clip, []).append(number)
    return OwnCell(
        value=float(np.mean([np.mean(mine) for mine in by_clip.values()])),
        spread=float(np.std([number for _, number in found])),
        cases=len(found),
        clips=len(by_clip),
        pairs=len({info.pair for info, _ in found}),
    )


# sets of answers
def _own_set_rows(table: PublishedTable, places: Sequence[ResultPaths]) -> list[OwnRow]:
    """Our methods in the columns of a table of sets, and per data set the floor: what real motion scores.

    Only results without references count (their headers say which structures have four legs). Of a method
    with several seeds, the first. A column's number is the mean over the structures that have one.
    """
    there = [(place, store.read_header(place.header)) for place in dict.fromkeys(places)]
    newest = compatibility.newest_by_label(header for _, header in there)
    results: list[tuple[ResultHeader, ResultPaths, list[SetValue]]] = []
    for place, header in there:
        if header.four_legged is None or place.split != "cross" or ".seed-" in place.method:
            continue
        latest = newest[header.dataset.label]
        values = [
            each for each in set_metrics.read(place) if not latest.why_value_outdated(header, each.value_id)
        ]
        if values and not latest.why_outdated(header):
            results.append((header, place, values))
    names = Counter((header.dataset.label, header.method.label) for header, _, _ in results)
    rows = []
    for header, place, values in results:
        label, mark = header.method.label, never_ranked(header.method)
        if names[header.dataset.label, label] > 1:
            label = f"{label} ({place.root})"
        found = {column.id: _values_of(column, header, values) for column in table.columns}
        rows.append(_set_row(label, mark, header, found, lambda each: each.value))
    for dataset in dict.fromkeys(header.dataset.label for header, _, _ in results):
        mine = [(header, values) for header, _, values in results if header.dataset.label == dataset]
        found = {}
        for column in table.columns:
            values = [each for header, all_of in mine for each in _values_of(column, header, all_of)]
            found[column.id] = _usual(values)
        rows.append(_set_row(FLOOR, FLOOR_MARK, mine[0][0], found, lambda each: each.floor))
    return [row for row in rows if row.cells or row.reasons]


def _values_of(column: PublishedColumn, header: ResultHeader, values: Sequence[SetValue]) -> list[SetValue]:
    """The values of a column, one per structure of that many legs."""
    four = set(header.four_legged or ())
    return [
        each
        for each in values
        if (each.value_id, each.kind) == (column.value, column.kind)
        and (each.structure in four) == (column.legs == 4)
    ]


def _set_row(
    label: str,
    mark: str,
    header: ResultHeader,
    values: dict[str, list[SetValue]],
    number: Callable[[SetValue], float | None],
) -> OwnRow:
    """A row from the values of every column. number: the value itself, or its floor."""
    cells, reasons = {}, {}
    for column, mine in values.items():
        if having := [(found, each) for each in mine if (found := number(each)) is not None]:
            mean = float(np.mean([found for found, _ in having]))
            n, clips = min(each.n for _, each in having), min(each.clips for _, each in having)
            cells[column] = OwnCell(mean, 0.0, n, clips, len(having))
        elif mine:
            reasons[column] = "; ".join(dict.fromkeys(each.reason for each in mine))
    which = "" if label == FLOOR else variant(header.method)
    return OwnRow(label, header.dataset.label, header.dataset.name, mark, cells, reasons, which)


def _usual(values: Sequence[SetValue]) -> list[SetValue]:
    """Per structure one of the values with the most common real set."""
    found = []
    for structure in dict.fromkeys(each.structure for each in values):
        mine = [each for each in values if each.structure == structure]
        given = [each for each in mine if each.value is not None] or mine
        real = Counter(each.real for each in given).most_common(1)[0][0]
        found.append(next(each for each in given if each.real == real))
    return found


# notes
def caveats(table: PublishedTable, rows: Sequence[OwnRow]) -> list[str]:
    """Sentences on why our numbers are not comparable with the printed ones."""
    if not rows and table.of_sets:
        return [
            "None of the results is between two legs and four without references: bench run METHOD -d "
            "'puppets[size=default,between=legs]' makes some."
        ]
    if not rows:
        return [
            "None of the results has a case that this table asks for: the pairs are of Mixamo's test set."
        ]
    asked = len({pair for column in table.columns for pair in column.pairs})
    found = []
    for dataset in dict.fromkeys(row.dataset for row in rows):
        own = [
            cells
            for row in rows
            if row.dataset == dataset
            if (cells := [row.cells[c.id] for c in table.columns if c.pairs and c.id in row.cells])
        ]
        clips = max((cell.clips for cells in own for cell in cells), default=0)
        pairs = max((sum(cell.pairs for cell in cells) for cells in own), default=0)
        if own and (clips, pairs) != (table.clips, asked):
            found.append(
                f"{dataset}: {pairs} of the {asked} pairs and {clips} of the {table.clips} "
                "test clips that the paper asks for, so its numbers do not compare with the printed ones."
            )
    return found
