"""What a table of results is made of. Numbers and the text that shows them are two fields."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from retarget_bench.analysis.statistics import Interval

ARROWS = {"lower": "↓", "higher": "↑", "target": "→", "none": ""}
NOT_APPLICABLE, FAILED, NOT_RUN, OTHER_VERSION = "n/a", "failed", "not run", "other version"
EMPTY = {
    NOT_APPLICABLE: "not applicable: the value is not defined for these cases or this method",
    FAILED: "the method was asked and gave no usable answer",
    NOT_RUN: "there is no result here, though the method has results elsewhere",
    OTHER_VERSION: "the result is of other data, or of another version of the metric, than the newest "
    "here: not comparable, so left out",
}
"""The four kinds of cell without a number."""

Mark = Literal["", "best", "tied"]
MARKS: dict[Mark, str] = {"": "", "best": "*", "tied": "="}


@dataclass(frozen=True)
class Column:
    """``meaning`` is for people who never saw the value; ``arrow`` says which way is better.

    version: the metric that computes it and its version, or "".
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

    @property
    def arrow(self) -> str:
        return ARROWS[self.better] + (f"{self.goal:g}" if self.better == "target" else "")

    @property
    def direction(self) -> str:
        """The arrow in words."""
        if self.better == "target":
            return f"best at {self.goal:g}, ranked by the mean of |log(value / {self.goal:g})|"
        words = {"lower": "less is better", "higher": "more is better"}
        return words.get(self.better, "a description, not ranked")


@dataclass(frozen=True)
class Cell:
    """What is shown, and the number behind it (None: there is none, and ``text`` is one of ``EMPTY``).

    interval: 95 % of the mean over clips; None where it is withheld.
    mark:     best of its column, or not separable from the best.
    decimals: with which ``text`` was written, and the interval is.
    n, clips: the cases and source clips behind the number (0: it is not a mean over cases).
    spread:   standard deviation over the seeds of a stochastic method, or None.
    reason:   why there is no number; ``footnote`` is its number below the table, or 0.
    place:    in the ranking of its column, from 0; None where it is not ranked.
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
    """One method, or one part of a breakdown. ``mark`` says why it is not ranked, or is "".

    n:     cases answered, out of those asked where not all were.
    about: what the method is, in a line, or "".
    """

    label: str
    mark: str
    cells: tuple[Cell, ...]
    n: str
    about: str = ""


@dataclass(frozen=True)
class Common:
    """The cases that all ranked methods have a column's value of, and their source clips."""

    cases: int
    clips: int


@dataclass(frozen=True)
class Group:
    """One split: ranked rows, best first by the first column, then those that are not ranked.

    Splits of one data set may have different columns: without references only some values exist.

    heading: what a row is: ``method``, or what a breakdown is by.
    common:  what each column is ranked on; None where it is not ranked.
    absent:  sentences about columns that were asked for and that no case here has.
    subject: the id of the value that is broken down; "" where the columns are values.
    counted: what n counts.
    structure, kind: of the target bodies and of the cases, where a group is of one.
    """

    title: str
    split: str
    columns: tuple[Column, ...]
    ranked: tuple[Row, ...]
    unranked: tuple[Row, ...]
    common: tuple[Common | None, ...]
    heading: str = "method"
    absent: tuple[str, ...] = ()
    subject: str = ""
    counted: str = "cases"
    structure: str = ""
    kind: str = ""

    @property
    def rows(self) -> tuple[Row, ...]:
        return (*self.ranked, *self.unranked)


@dataclass(frozen=True)
class Problem:
    """Cases that a method gave no usable answer to, for one reason; ``more`` reasons that are not told are
    those of other refusals, which mostly differ in the name of the body."""

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
    """Where the rows of a method come from: what made them, when, with what, and how to make them again."""

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

    notes:     sentences that belong below the table: what the data leave out, which versions met.
    footnotes: what the numbers in cells (from 1) refer to.
    data:      name, version and content of the data set, as (what, which) pairs.
    subjects:  the values that a breakdown is of.
    reading:   what the numbers are, where they are not the means of ours that legends describe.
    """

    title: str
    groups: tuple[Group, ...]
    notes: tuple[str, ...] = ()
    footnotes: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()
    origins: tuple[Provenance, ...] = ()
    data: tuple[tuple[str, str], ...] = ()
    subjects: tuple[Column, ...] = ()
    reading: str = ""

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of all groups, each once."""
        return tuple(dict.fromkeys(column for group in self.groups for column in group.columns))

    @property
    def explained(self) -> tuple[Column, ...]:
        """The values that a reader must know to read the table."""
        return self.subjects or self.columns

    @property
    def cells(self) -> tuple[Cell, ...]:
        return tuple(cell for group in self.groups for row in group.rows for cell in row.cells)


@dataclass
class Footnotes:
    """Sentences that cells refer to by number; the same sentence has one number."""

    sentences: list[str] = field(default_factory=list)

    def number(self, sentence: str) -> int:
        if not sentence:
            return 0
        if sentence not in self.sentences:
            self.sentences.append(sentence)
        return self.sentences.index(sentence) + 1


def count(number: int, noun: str) -> str:
    """``1 case``, ``2 cases``."""
    return f"{number} {noun}" + ("" if number == 1 else "s")
