"""Our numbers, from the tables in ``results/`` that ``bench table --paper`` and ``bench ablate`` wrote.

Rows of cases are not kept in the repository; these tables are, and say over what their numbers are means.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from retarget_bench.errors import FileError
from tools.ledger.printed import PrintedColumn

PRINTED = " (printed)"
ARROW = re.compile(r" (?:[↓↑]|→1)(?:<br>.*)?$")
COUNTS = re.compile(r"cases?, pairs (\d+)(?: of (\d+))?, clips (\d+)(?: of (\d+))?$")


@dataclass(frozen=True)
class Coverage:
    """Pairs and clips that a number is over, and how many the paper asks for (0: it asks for others)."""

    pairs: int
    pairs_asked: int
    clips: int
    clips_asked: int

    @property
    def same_pairs(self) -> bool:
        return self.pairs == self.pairs_asked > 0

    @property
    def whole(self) -> bool:
        return self.same_pairs and self.clips == self.clips_asked > 0

    def __str__(self) -> str:
        if not self.pairs_asked:
            return f"{self.pairs} pairs, {self.clips} clips"
        return f"{self.pairs} of {self.pairs_asked} pairs, {self.clips} of {self.clips_asked} clips"


@dataclass(frozen=True)
class Measured:
    """A number of ours. spread: over cases, or None. variant: of the method. data: that it is on."""

    value: float
    text: str
    spread: float | None
    method: str
    variant: str
    data: str
    coverage: Coverage | None

    @property
    def of_paper(self) -> bool:
        """It is over some of the paper's pairs."""
        return self.coverage is not None and self.coverage.pairs_asked > 0

    @property
    def same_pairs(self) -> bool:
        """It is over just these."""
        return self.coverage is not None and self.coverage.same_pairs

    @property
    def on(self) -> str:
        """The data without what their label says in brackets, and what of them."""
        before, bracket, rest = self.data.partition(" (")
        label = before + rest.partition(")")[2] if bracket else before
        return f"{label}, {self.coverage}" if self.coverage else label


class ResultTable:
    """One table of a page. lines: of the page, from its heading on."""

    def __init__(self, lines: Sequence[str]) -> None:
        self._lines = [line.replace("&gt;", ">").replace("&lt;", "<") for line in lines]

    def number(self, method: str, column: PrintedColumn) -> Measured | None:
        """The number of a method in a column, over the paper's pairs if there is one, else over others."""
        own = column.label, column.parts or (column.label,)
        for label, parts in (own, (column.other, (column.other,))):
            for (name, variant, head), text in self._cells.items():
                if (name, head) == (method, label) and (found := _parsed(text)):
                    return Measured(*found, method, variant, self.data, self._coverage(parts))
        return None

    def variants(self) -> dict[str, str]:
        """Method -> how it differs from its paper, where the page says so."""
        return {label: variant for label, variant, _ in self._cells if variant}

    @cached_property
    def data(self) -> str:
        """The label of the data set."""
        notes = (re.match(r"- n, (.+?): ", line) for line in self._lines)
        return next((found[1] for found in notes if found), "")

    @cached_property
    def _cells(self) -> dict[tuple[str, str, str], str]:
        """(method, variant, column) -> text, without printed rows."""
        found: dict[tuple[str, str, str], str] = {}
        heads: list[str] = []
        for cells in (_split(line) for line in self._lines if not line.startswith("|-")):
            if not cells:
                heads = []
            elif not heads:
                heads = [ARROW.sub("", each) for each in cells]
            elif not cells[0].endswith(PRINTED):
                label, _, variant = cells[0].partition(" (")
                for head, text in zip(heads[1:], cells[1:], strict=True):
                    found.setdefault((label, variant.removesuffix(")"), head), text)
        return found

    @cached_property
    def _counts(self) -> list[tuple[str, Coverage]]:
        """Labels of columns, joined by commas, and what their numbers are over."""
        return [each for line in self._lines for each in _counted(line)]

    def _coverage(self, columns: Sequence[str]) -> Coverage | None:
        """What the mean of columns is over: of the paper's pairs those in all of them."""
        found = [each for column in columns if (each := self._over(column))]
        if not found:
            return None
        asked = sum(each.pairs_asked for each in found)
        missing = (len(columns) - len(found)) * found[0].pairs_asked
        pairs = sum(each.pairs for each in found)
        return Coverage(pairs, asked + missing, found[0].clips, found[0].clips_asked)

    def _over(self, column: str) -> Coverage | None:
        whole = re.compile(rf"(?:^|[:,] ){re.escape(column)}(?:,|$)")
        return next((over for labels, over in self._counts if whole.search(labels)), None)


def result_tables(path: Path) -> dict[str, ResultTable]:
    """The tables of a page by heading. Raises FileError for a page that is not there, or without any."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror}") from error
    parts = [part.splitlines() for part in f"\n{text}".split("\n## ")[1:]]
    if not parts:
        raise FileError(path, "holds no table of results")
    return {lines[0]: ResultTable(lines) for lines in parts}


def _split(line: str) -> list[str]:
    """The cells of a line of a table, without escapes; [] for other lines."""
    if not line.startswith("| "):
        return []
    return [re.sub(r"\\(.)", r"\1", each.strip()) for each in re.split(r"(?<!\\)\|", line)[1:-1]]


def _parsed(text: str) -> tuple[float, str, float | None] | None:
    """Number, its text and its spread; None for a cell without a number."""
    shown = text.partition("<br>")[0]
    found = re.match(r"(-?[\d.]+)(?: ±([\d.]+))?", shown)
    return (float(found[1]), found[0], float(found[2]) if found[2] else None) if found else None


def _counted(line: str) -> Iterator[tuple[str, Coverage]]:
    if not line.startswith("- n, "):
        return
    for part in line.removeprefix("- n, ").rstrip(".").split("; "):
        labels, _, counts = part.rpartition(": ")
        if found := COUNTS.search(counts):
            yield labels, Coverage(*(int(each or 0) for each in found.groups()))
