"""The table model: tables, groups, rows and cells; numbers and their text are separate fields."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from retarget_bench.analysis.ranking import Ranking
from retarget_bench.analysis.statistics import Interval

ARROWS = {"lower": "↓", "higher": "↑", "target": "→", "none": ""}
NOT_APPLICABLE, FAILED, NOT_RUN, OTHER_VERSION = "n/a", "failed", "not run", "other version"
EMPTY = {
    NOT_APPLICABLE: "not applicable: the value is undefined for these cases or this method",
    FAILED: "the method gave no usable answer",
    NOT_RUN: "no result here, though the method has results elsewhere",
    OTHER_VERSION: "not comparable: other data, or another version of the metric, than the newest results",
}
"""The four kinds of missing value."""
CONTROL = "control"
UNTRAINED, LEARNED = "untrained", "learned"
NOT_RANKED, CONTROLS = "not ranked", "controls, not ranked"
"""Headings of rows."""

Mark = Literal["", "best", "tied"]
MARKS: dict[Mark, str] = {"": "", "best": "*", "tied": "="}


@dataclass(frozen=True)
class Column:
    """A value, with its meaning for readers who do not know it, or a method in a breakdown.

    version: the metric that computes it and its version, or "".
    split:   the split that it is of, in groups of several; or "".
    mark:    where a column is a method: why it is not ranked, or "".
    """

    id: str
    label: str
    unit: str
    better: str
    meaning: str
    goal: float = 1.0
    formula: str = ""
    version: str = ""
    mark: str = ""
    split: str = ""

    @property
    def arrow(self) -> str:
        return ARROWS[self.better] + (f"{self.goal:g}" if self.better == "target" else "")

    @property
    def direction(self) -> str:
        """The direction in words."""
        if self.better == "target":
            return f"best at {self.goal:g}, ranked by the mean of |log(value / {self.goal:g})|"
        words = {"lower": "less is better", "higher": "more is better"}
        return words.get(self.better, "a description, not ranked")


@dataclass(frozen=True)
class Cell:
    """The text of a cell, and the number behind it (None: missing, and ``text`` is one of ``EMPTY``).

    interval: 95 % interval of the mean over clips; None where there are too few clips.
    mark:     best of its column, or tied with the best.
    decimals: of ``text`` and of the interval.
    n, clips: the cases and source clips behind the number (0: it is not a mean over cases).
    spread:   standard deviation over the seeds of a stochastic method, or None.
    reason:   why the number is missing or not ranked; ``footnote`` is its number below the table, or 0.
    place:    rank in its column, from 0; None where it is not ranked.
    """

    text: str
    value: float | None = None
    interval: Interval | None = None
    mark: Mark = ""
    decimals: int = 0
    n: int = 0
    clips: int = 0
    spread: float | None = None
    reason: str = ""
    footnote: int = 0
    place: int | None = None

    @property
    def between(self) -> str:
        """The interval as text; "" where there is none."""
        if self.interval is None:
            return ""
        ends = (f"{end:.{self.decimals}f}" for end in (self.interval.low, self.interval.high))
        low, high = (end if float(end) else end.removeprefix("-") for end in ends)
        return f"{low} to {high}" if low.startswith("-") else f"{low}–{high}"

    @property
    def between_seeds(self) -> str:
        """The spread over seeds as text; "" where there is none."""
        return "" if self.spread is None else f"{self.spread:.{self.decimals}f}"


@dataclass(frozen=True)
class Row:
    """One method, or one part of a breakdown. ``mark``: why it is not ranked, or "".

    n:     number of cases answered, or answered/asked; "" in groups of several splits.
    about: summary of the method, or "". learned: whether it has been trained.
    """

    label: str
    mark: str
    cells: tuple[Cell, ...]
    n: str
    about: str = ""
    learned: bool = False


@dataclass(frozen=True)
class Group:
    """One split, or several side by side: ranked rows, best first, then those that are not ranked.

    Splits of one data set may have different columns: without references only some values exist.

    heading: of the rows: ``method``, or the kind of breakdown.
    common:  of each column the ranking, whose cases all compared rows are over; or None.
    subject: the id of the value that is broken down; "" where the columns are values.
    below:   sentences directly below the rows: what columns, marks and rows lack, and floors.
    counted: the unit of n.
    structure, kind: of target bodies and cases, in tables of sets.
    """

    title: str
    split: str
    columns: tuple[Column, ...]
    ranked: tuple[Row, ...]
    unranked: tuple[Row, ...]
    common: tuple[Ranking | None, ...] = ()
    heading: str = "method"
    subject: str = ""
    below: tuple[str, ...] = ()
    counted: str = "cases"
    structure: str = ""
    kind: str = ""

    @property
    def rows(self) -> tuple[Row, ...]:
        return (*self.ranked, *self.unranked)

    @property
    def blocks(self) -> tuple[tuple[str, tuple[Row, ...]], ...]:
        """Headings and rows: untrained and learned methods (without a heading where all are of one kind),
        then what is not ranked, controls last."""
        learned = {row.learned for row in self.ranked}
        kinds = {UNTRAINED: False, LEARNED: True} if len(learned) > 1 else {"": True in learned}
        blocks = {
            heading: tuple(row for row in self.ranked if row.learned == kind)
            for heading, kind in kinds.items()
        }
        blocks[NOT_RANKED] = tuple(row for row in self.unranked if row.mark != CONTROL)
        blocks[CONTROLS] = tuple(row for row in self.unranked if row.mark == CONTROL)
        return tuple((heading, rows) for heading, rows in blocks.items() if rows)

    @property
    def counts(self) -> bool:
        """True if rows have an n."""
        return any(row.n for row in self.rows) or not self.rows


@dataclass(frozen=True)
class Problem:
    """Cases without a usable answer of a method, or with one that is doubted, and why; ``more``: similar
    reasons left out."""

    split: str
    label: str
    status: str
    message: str
    cases: tuple[str, ...]
    more: int = 0

    @property
    def sentence(self) -> str:
        others = f"; {count(self.more, 'reason')} more of this kind" if self.more else ""
        return (
            f"{self.split}: {self.label} {self.status} on {count(len(self.cases), 'case')} "
            f"(first {self.cases[0]}): {self.message}{others}"
        )


@dataclass(frozen=True)
class Provenance:
    """Provenance of a method's rows: version, code, seeds, date, and the command that makes them again."""

    label: str
    about: str
    splits: tuple[str, ...]
    version: str
    code: str
    seeds: tuple[int, ...]
    date: str
    revision: str
    versions: str
    command: str


@dataclass(frozen=True)
class Table:
    """The results on one data set.

    finding:   one sentence on what the table shows, or "".
    notes:     sentences for those who want to know all: speeds, what the data leave out, versions.
    footnotes: texts of the footnote numbers in cells, from 1.
    data:      (fact, value) pairs about the data set.
    splits:    split -> what its cases have in common.
    subjects:  the values in a breakdown.
    hints:     sentences about what is left out.
    reading:   how to read the numbers, where they are not means over clips.
    """

    title: str
    groups: tuple[Group, ...]
    finding: str = ""
    notes: tuple[str, ...] = ()
    footnotes: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()
    provenance: tuple[Provenance, ...] = ()
    data: tuple[tuple[str, str], ...] = ()
    subjects: tuple[Column, ...] = ()
    reading: str = ""
    hints: tuple[str, ...] = ()
    splits: Mapping[str, str] = field(default_factory=dict)

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of all groups, each once."""
        return tuple(dict.fromkeys(column for group in self.groups for column in group.columns))

    @property
    def explained(self) -> tuple[Column, ...]:
        """The columns that the legend explains."""
        return self.subjects or tuple(dict.fromkeys(replace(each, split="") for each in self.columns))

    @property
    def cells(self) -> tuple[Cell, ...]:
        return tuple(cell for group in self.groups for row in group.rows for cell in row.cells)


@dataclass
class Footnotes:
    """Numbered footnotes; equal sentences share a number."""

    sentences: list[str] = field(default_factory=list)

    def number(self, sentence: str) -> int:
        if not sentence:
            return 0
        if sentence not in self.sentences:
            self.sentences.append(sentence)
        return self.sentences.index(sentence) + 1

    def missing(self, reason: str, kind: str = NOT_APPLICABLE) -> Cell:
        """A cell without a number, and the reason below the table."""
        return Cell(kind, reason=reason, footnote=self.number(reason))


def listed(names: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def count(number: int, noun: str) -> str:
    """``1 case``, ``2 cases``."""
    return f"{number} {noun}" + ("" if number == 1 else "s")
