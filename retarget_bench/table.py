"""One table of results, whatever it is later drawn as."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from retarget_bench.errors import BenchError
from retarget_bench.summary import Score, Section

FPS = "fps"
FIRST_SIGHT = (
    "mpjpe_h.world",
    "mpjpe_h.root",
    "contact_recall",
    "contact_precision",
    "foot_slide",
    "jerk_ratio",
    FPS,
)
"""The columns of a table when nobody asks for others."""

ARROWS = {"lower": "↓", "higher": "↑", "target": "→", "none": ""}
NOTHING = "–"


@dataclass(frozen=True)
class Column:
    """``meaning`` is for people who never saw the value; ``arrow`` says which way is better."""

    id: str
    label: str
    unit: str
    better: str
    meaning: str
    goal: float = 1.0

    @property
    def arrow(self) -> str:
        return ARROWS[self.better] + (f"{self.goal:g}" if self.better == "target" else "")


@dataclass(frozen=True)
class Cell:
    """What is shown, and the number behind it (None: there is none, and ``text`` says which kind)."""

    text: str
    value: float | None = None


@dataclass(frozen=True)
class Row:
    """One method. ``mark`` says why it is not ranked, or is ""."""

    label: str
    mark: str
    cells: tuple[Cell, ...]
    n: str


@dataclass(frozen=True)
class Group:
    """One split: ranked rows, best first by the first column, then those that are not ranked.

    Splits of one data set may have different columns: without references only some values exist.
    """

    title: str
    columns: tuple[Column, ...]
    ranked: tuple[Row, ...]
    unranked: tuple[Row, ...]


@dataclass(frozen=True)
class Table:
    """``notes`` are sentences that belong below the table."""

    title: str
    groups: tuple[Group, ...]
    notes: tuple[str, ...]

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of all groups, each once."""
        return tuple(dict.fromkeys(column for group in self.groups for column in group.columns))


def tables(found: Sequence[Section], columns: Sequence[str] = FIRST_SIGHT) -> list[Table]:
    """One table per data set. ``columns`` are value ids, or ``fps``.

    Raises BenchError for no column at all, for one that no result declares, listing those there are, and
    for one that is a curve.
    """
    declared = {key: value for section in found for key, value in section.values.items()}
    by_dataset: dict[str, list[Section]] = {}
    for section in found:
        by_dataset.setdefault(section.dataset, []).append(section)
    if columns is not FIRST_SIGHT:
        _check_columns(columns, declared)
    return [_table(title, each, columns, declared) for title, each in by_dataset.items()]


def _check_columns(columns: Sequence[str], declared: Mapping[str, Mapping[str, Any]]) -> None:
    known = ", ".join([FPS, *sorted(key for key, value in declared.items() if not value["index"])])
    if not columns:
        raise BenchError(f"name at least one column; there are {known}")
    for column in columns:
        if column == FPS:
            continue
        if column not in declared:
            raise BenchError(f"no result has a value {column!r}; there are {known}")
        if index := declared[column]["index"]:
            raise BenchError(f"{column} has a number per {index}; a table shows single numbers: {known}")


def all_columns(found: Sequence[Section]) -> list[str]:
    """Every value that is one number per case, in declared order, then fps."""
    ids = {key: None for section in found for key, value in section.values.items() if not value["index"]}
    return [*ids, FPS]


def _table(
    title: str, found: Sequence[Section], wanted: Sequence[str], declared: Mapping[str, Mapping[str, Any]]
) -> Table:
    groups = []
    for section in found:
        present = {key for score in section.scores for key in score.means}
        keys = [key for key in (_stand_in(key, present) for key in wanted) if key is not None]
        decimals = {key: _decimals(_numbers(found, key)) for key in keys}
        groups.append(_group(section, [_column(key, declared) for key in keys], decimals))
    return Table(title=title, groups=tuple(groups), notes=tuple(_notes(found)))


def _stand_in(key: str, present: set[str]) -> str | None:
    """The column itself, or where no case has it the same measure against the source."""
    if key == FPS or key in present:
        return key
    return f"{key}_src" if f"{key}_src" in present else None


def _column(key: str, declared: Mapping[str, Mapping[str, Any]]) -> Column:
    if key == FPS:
        meaning = "frames retargeted per second by one process and one thread, reading and writing aside"
        return Column(FPS, "fps", "1/s", "higher", meaning)
    value = declared[key]
    return Column(key, value["label"], value["unit"], value["better"], value["meaning"], value["goal"])


def _group(section: Section, columns: Sequence[Column], decimals: Mapping[str, int]) -> Group:
    rows = [(_row(score, columns, decimals), score.unranked) for score in section.scores]
    if columns:
        rows.sort(key=lambda pair: _rank(pair[0].cells[0], columns[0]))
    frames = f", {section.frames} frames" if section.frames else ""
    asked = max(score.asked for score in section.scores)
    return Group(
        columns=tuple(columns),
        title=f"{section.split}: {_count(asked, 'case')} of {_count(section.clips, 'clip')} and "
        f"{_count(section.pairs, 'pair')}{frames}",
        ranked=tuple(row for row, unranked in rows if not unranked),
        unranked=tuple(row for row, unranked in rows if unranked),
    )


def _row(score: Score, columns: Sequence[Column], decimals: Mapping[str, int]) -> Row:
    cells = tuple(_cell(_number(score, column.id), score, decimals[column.id]) for column in columns)
    n = f"{score.ok}" if score.ok == score.asked else f"{score.ok}/{score.asked}"
    return Row(score.label, score.unranked, cells, n)


def _cell(number: float | None, score: Score, decimals: int) -> Cell:
    if number is not None:
        return Cell(f"{number:.{decimals}f}", number)
    counts = score.header["counts"]
    if score.ok:
        return Cell(NOTHING)
    return Cell("failed" if counts["failed"] + counts["invalid"] else "n/a")


def _number(score: Score, key: str) -> float | None:
    if key == FPS:
        return score.fps
    return score.means[key].value if key in score.means else None


def _numbers(found: Sequence[Section], key: str) -> list[float]:
    """Those of the ranked methods, which decide how a column is written; of all where none is ranked."""
    scores = [score for section in found for score in section.scores]
    ranked = [score for score in scores if not score.unranked]
    numbers = (_number(score, key) for score in ranked or scores)
    return [number for number in numbers if number is not None]


def _rank(cell: Cell, column: Column) -> tuple[bool, float]:
    """Smaller is better; no number comes last."""
    if cell.value is None:
        return (True, 0.0)
    if column.better == "target":
        return (False, abs(math.log(cell.value / column.goal)) if cell.value > 0 else math.inf)
    return (False, -cell.value if column.better == "higher" else cell.value)


def _decimals(numbers: Sequence[float]) -> int:
    """As many as show three significant digits of the column's typical number (dust aside)."""
    sizes = sorted(abs(number) for number in numbers if abs(number) > 1e-9)
    sizes = [size for size in sizes if size > 1e-3 * sizes[-1]]
    if not sizes:
        return 2
    return min(7, max(0, 2 - math.floor(math.log10(sizes[len(sizes) // 2]))))


def _notes(found: Sequence[Section]) -> list[str]:
    notes = {note: None for section in found for note in section.notes}
    for section in found:
        for score in section.scores:
            for problem in score.header["problems"]:
                cases = problem["cases"]
                notes[
                    f"{section.split}: {score.label} {problem['status']} on {_count(len(cases), 'case')} "
                    f"(first {cases[0]}): {problem['message']}"
                ] = None
    return list(notes)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")
