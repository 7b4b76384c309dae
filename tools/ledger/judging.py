"""One entry of the ledger: a printed number, ours, their ratio and the verdict."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import sqrt
from typing import Literal

from pydantic import BaseModel, ConfigDict

from tools.ledger.measured import Measured, ResultTable
from tools.ledger.printed import PrintedColumn, PrintedNumber, PrintedTable

CLOSE = 0.05
"""Largest difference of a ratio from 1 that counts as reproduced."""

Word = Literal["reproduced", "differs", "cannot be told"]


class _Facts(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Reason(_Facts):
    """Why numbers differ, or cannot be compared. rows, columns: that it holds for; none: all."""

    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    differs: str = ""
    unknown: str = ""

    def holds(self, row: str, column: str) -> bool:
        return (not self.rows or row in self.rows) and (not self.columns or column in self.columns)


class Elsewhere(_Facts):
    """A number of ours under the same protocol that no page of ``results/`` holds. on: what it is over."""

    row: str
    column: str
    ours: float
    text: str
    by: str
    on: str


class TableFacts(_Facts):
    """What the ledger knows of a table.

    prose:   at most three sentences. results: pages of ours, the better comparable first.
    ours:    row -> our method of the same name; where it depends on the column, column -> method.
    also:    row -> other methods of ours, listed below the table where they have numbers.
    trained: what ours are where they are not shipped methods but were trained for this table, or "".
    """

    table: str
    prose: str
    results: tuple[str, ...] = ()
    ours: Mapping[str, str | Mapping[str, str]] = {}
    also: Mapping[str, tuple[str, ...]] = {}
    trained: str = ""
    elsewhere: tuple[Elsewhere, ...] = ()
    reasons: tuple[Reason, ...] = ()

    def after(self, reasons: tuple[Reason, ...]) -> "TableFacts":
        """The same with further reasons, which its own override."""
        return self.model_copy(update={"reasons": (*reasons, *self.reasons)})

    def method(self, row: str, column: str) -> str:
        """Our method for a printed number, or ""."""
        found = self.ours.get(row, "")
        return found if isinstance(found, str) else found.get(column, "")

    def reason(self, row: str, column: str, of: Literal["differs", "unknown"]) -> str:
        """The last reason that holds and says something."""
        said = [getattr(each, of) for each in self.reasons if each.holds(row, column)]
        return next((each for each in reversed(said) if each), "")


@dataclass(frozen=True)
class Entry:
    """ours: text, or "". by: method, or "". trained: where it is no shipped one. on: data and what of them.
    ratio: ours over printed, or None."""

    row: str
    column: PrintedColumn
    printed: PrintedNumber
    word: Word
    because: str
    ours: str = ""
    by: str = ""
    trained: str = ""
    on: str = ""
    ratio: float | None = None


@dataclass(frozen=True)
class Judge:
    """Compares a printed table with ours of the same heading. pages: name -> heading -> table."""

    table: PrintedTable
    facts: TableFacts
    pages: Mapping[str, Mapping[str, ResultTable]] = field(default_factory=dict)

    @property
    def measured(self) -> list[ResultTable]:
        """Our tables, the better comparable first."""
        pages = (self.pages[name] for name in self.facts.results)
        return [page[self.table.heading] for page in pages if self.table.heading in page]

    def entries(self) -> list[Entry]:
        """An entry for every printed number, in the paper's order."""
        return [
            self._entry(row, column, numbers[column.id])
            for row, numbers in self.table.rows.items()
            for column in self.table.columns
            if column.id in numbers
        ]

    def others(self) -> list[tuple[str, PrintedColumn, Measured]]:
        """Numbers of further methods of ours over pairs of the paper: (printed row, column, number)."""
        return [
            (row, column, found)
            for row, methods in self.facts.also.items()
            for column in self.table.columns
            if column.id in self.table.rows[row]
            for method in methods
            if (found := self._measured(method, column)) and found.of_paper
        ]

    def _entry(self, row: str, column: PrintedColumn, printed: PrintedNumber) -> Entry:
        for each in self.facts.elsewhere:
            if (each.row, each.column) == (row, column.id):
                return self._elsewhere(each, column, printed)
        method = self.facts.method(row, column.id)
        found = self._measured(method, column)
        if found is None:
            return Entry(row, column, printed, "cannot be told", self._unknown(row, column, method))
        word, because = self._verdict(row, column, printed, found)
        return Entry(
            row,
            column,
            printed,
            word,
            because,
            ours=found.text,
            by="" if self.facts.trained else found.method,
            trained=self.facts.trained,
            on=found.on,
            ratio=found.value / printed.value if found.same_pairs else None,
        )

    def _elsewhere(self, each: Elsewhere, column: PrintedColumn, printed: PrintedNumber) -> Entry:
        ratio = each.ours / printed.value
        word: Word = "reproduced" if close(ratio) else "differs"
        because = "" if close(ratio) else self.facts.reason(each.row, column.id, "differs")
        return Entry(
            each.row, column, printed, word, because, each.text, trained=each.by, on=each.on, ratio=ratio
        )

    def _measured(self, method: str, column: PrintedColumn) -> Measured | None:
        if not method:
            return None
        found = (each.number(method, column) for each in self.measured)
        return next((each for each in found if each), None)

    def _verdict(
        self, row: str, column: PrintedColumn, printed: PrintedNumber, ours: Measured
    ) -> tuple[Word, str]:
        over = ours.coverage
        if over is None or not over.same_pairs:
            partly = f"only {over} are at hand" if over and over.pairs_asked else "ours is on other data"
            return "cannot be told", self.facts.reason(row, column.id, "unknown") or partly
        near = close(ours.value / printed.value)
        if over.whole and near:
            return "reproduced", ""
        if over.whole or beyond_chance(printed.value, ours):
            return "differs", self.facts.reason(row, column.id, "differs")
        return "cannot be told", f"{over.clips} of {over.clips_asked} clips do not tell the two apart"

    def _unknown(self, row: str, column: PrintedColumn, method: str) -> str:
        said = self.facts.reason(row, column.id, "unknown") or column.missing
        return said or (f"no table of ours has `{method}` in this column" if method else "")


def close(ratio: float) -> bool:
    """Whether two numbers count as the same."""
    return abs(ratio - 1) <= CLOSE


def beyond_chance(printed: float, ours: Measured) -> bool:
    """Whether a mean over a part of the clips lies further from the printed one than the choice of clips
    explains: by more than two standard errors over clips, and by more than what counts as the same.

    The standard error is of the spread over cases, of which a clip has one for each pair.
    """
    if ours.spread is None or ours.coverage is None or close(ours.value / printed):
        return False
    return abs(ours.value - printed) > 2 * ours.spread / sqrt(ours.coverage.clips)
