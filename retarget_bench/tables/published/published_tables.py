"""Published tables and our own results in their columns.

``published/*.toml`` hold the printed numbers. Each column names our value of the same protocol and the
pairs it is a mean over, or why there is none.
"""

import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from retarget_bench import defaults
from retarget_bench.analysis.summary import never_ranked
from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.results import case_metadata, columns, compatibility, store
from retarget_bench.results.columns import Columns
from retarget_bench.results.store import ResultPaths

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
        """Whether it compares sets of answers (``own_set_rows.py``) and not answers with right ones."""
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
    """One method of ours on one data set: column -> cell, where it has any; reasons: why it has none."""

    label: str
    dataset: str
    name: str
    mark: str
    cells: Mapping[str, OwnCell]
    reasons: Mapping[str, str] = field(default_factory=dict)


def names() -> list[str]:
    """The published tables there are."""
    return sorted(each.name[:-5] for each in _folder().iterdir() if each.name.endswith(".toml"))


@cache
def published(name: str) -> PublishedTable:
    """A published table. Raises BenchError for a name that there is none of."""
    if name not in names():
        raise BenchError(f"there is no published table {name!r}; there are {', '.join(names())}")
    text = (_folder() / f"{name}.toml").read_text(encoding="utf-8")
    return PublishedTable.model_validate(tomllib.loads(text))


def _folder() -> Traversable:
    return files("retarget_bench.tables.published")


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
            cells[column.id] = _mean_of(parts, [each for part in column.mean_of for each in asked[part]])
        elif asked.get(column.id):
            cells[column.id] = _mean(asked[column.id])
    reasons = {} if trained else {column.id: UNTRAINED for column in table.columns if column.seen}
    return OwnRow(label, dataset, header.dataset.name, never_ranked(header.method), cells, reasons)


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


def _mean_of(parts: Sequence[OwnCell], found: Sequence[tuple[CaseInfo, float]]) -> OwnCell:
    """The mean of means, as the papers take it; all else is of all cases together."""
    return replace(_mean(found), value=float(np.mean([part.value for part in parts])))


# ------------------------------------------------------------------------------------- what it means
def asked_pairs(table: PublishedTable) -> int:
    """How many pairs the paper's columns ask for."""
    return len({pair for column in table.columns for pair in column.pairs})


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
    found = []
    for dataset in dict.fromkeys(row.dataset for row in rows):
        mine = [row for row in rows if row.dataset == dataset]
        if not any(column.pairs for column in table.columns):
            continue
        own = [
            cell
            for row in mine
            for column in table.columns
            if column.pairs and (cell := row.cells.get(column.id))
        ]
        if not own:
            continue
        clips, pairs = max(cell.clips for cell in own), max(_pairs(table, row) for row in mine)
        if (clips, pairs) != (table.clips, asked_pairs(table)):
            found.append(
                f"{dataset}: {pairs} of the {asked_pairs(table)} pairs and {clips} of the {table.clips} "
                "test clips that the paper asks for, so its numbers do not compare with the printed ones."
            )
    return found


def _pairs(table: PublishedTable, row: OwnRow) -> int:
    return sum(
        row.cells[column.id].pairs for column in table.columns if column.pairs and column.id in row.cells
    )
