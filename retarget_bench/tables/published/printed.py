"""Printed tables of papers, from the CSV files of this folder.

``tables.csv`` names the tables, ``notes.csv`` has sentences about them. The files of papers have a line for
every printed number: where it stands (paper, table, row, column), the value with the paper's digits, its
spread, unit and protocol, and what of ours it is to be compared with: the id of our value and the cases
that it is over, or why there is none. Lines without a row are columns that we add.
"""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib.resources import files
from itertools import product
from typing import Literal

from retarget_bench.api import SELF
from retarget_bench.errors import BenchError

PAPERS = ("pan.csv", "humot.csv", "correspondence_free.csv")
COUNTED = "counted"
"""``origin`` of a number that is not the paper's but a count of our networks."""
MEAN, SEEN, UNSEEN, NOT_SELF, STRUCTURE = "mean", "seen", "unseen", "all others", "structure"
_FOLDER = files("retarget_bench.tables.published")


@dataclass(frozen=True)
class Column:
    """A column of a published table, or one that we add to it.

    protocol: of the printed numbers, in words.
    value_id: of our value of the same meaning; "": there is none, and ``missing`` says why.
    cases:    what ours is a mean over: ``A>B`` pairs of the papers' data set (``A|B>C`` are two); splits,
              or ``all others`` than self, of whatever data; ``mean``: the columns of pairs; ``seen``,
              ``unseen``: targets of structures that training had, or had not; ``structure NAME``; of sets
              of answers ``2 legs`` or ``4 legs``, of the targets, and the kind of performance.
    block:    columns of one block are drawn together; "": the paper's.
    repeats:  the paper's column of the same meaning, where this one is over other cases; or "".
    """

    label: str
    unit: str
    protocol: str
    value_id: str
    cases: str
    block: str
    repeats: str
    missing: str

    @property
    def pairs(self) -> frozenset[str]:
        """``source>target`` of its cases; none where they are chosen otherwise."""
        ends = [[side.split("|") for side in part.split(">")] for part in self.cases.split() if ">" in part]
        return frozenset(
            f"{one}>{two}" for sources, targets in ends for one, two in product(sources, targets)
        )

    @property
    def chosen_by(self) -> Literal["pairs", "sets", "mean", "training", "structure", "splits"]:
        """How its cases are chosen."""
        if ">" in self.cases:
            return "pairs"
        if "legs" in self.cases:
            return "sets"
        if self.cases == MEAN:
            return "mean"
        if self.cases in (SEEN, UNSEEN):
            return "training"
        return "structure" if self.cases.startswith(f"{STRUCTURE} ") else "splits"

    @property
    def over(self) -> str:
        """Its cases in words."""
        words = {
            "pairs": "the paper's pairs",
            "mean": "the mean of the paper's pairs",
            "sets": f"bodies of {self.cases}",
        }
        if self.chosen_by == "training":
            return f"bodies of structures that training {'had' if self.cases == SEEN else 'had not'}"
        return words.get(self.chosen_by, self.cases)

    def takes(self, split: str) -> bool:
        """True for a split that a column of splits is over."""
        return split != SELF if self.cases == NOT_SELF else split in self.cases.split()


@dataclass(frozen=True)
class Number:
    """A number with the paper's digits. spread: after the sign ±, or "". method: ours that rebuilds its
    row, or "". note: what else is known of it, or ""."""

    text: str
    spread: str = ""
    origin: str = "printed"
    method: str = ""
    note: str = ""


@dataclass(frozen=True)
class PublishedTable:
    """A table as published.

    name:   in commands. source: paper and place.
    rows:   row -> label of a column -> number.
    clips:  how many test clips it is over (0: other data than ours). task: whose results answer to it.
    digits: decimals of ours; 0: as many as are printed.
    """

    name: str
    title: str
    source: str
    columns: tuple[Column, ...]
    rows: Mapping[str, Mapping[str, Number]]
    notes: tuple[str, ...] = ()
    clips: int = 0
    task: str = "retarget"
    digits: int = 0

    @property
    def of_sets(self) -> bool:
        """True for a table that compares sets of answers with real motion."""
        return any(column.chosen_by == "sets" for column in self.columns)

    def has_spread(self, label: str) -> bool:
        """True for a column with printed spreads."""
        return any(row[label].spread for row in self.rows.values() if label in row)

    def decimals(self, label: str) -> int:
        """Decimals of ours in a column: as many as are printed; where nothing is, as many as elsewhere."""
        numbers = [row[label] for row in self.rows.values() if label in row]
        numbers = numbers or [number for row in self.rows.values() for number in row.values()]
        return self.digits or max(len(each.text.partition(".")[2]) for each in numbers)


@cache
def _lines(file: str) -> tuple[Mapping[str, str], ...]:
    return tuple(csv.DictReader((_FOLDER / file).read_text(encoding="utf-8").splitlines()))


def names() -> list[str]:
    """The published tables that there are."""
    return sorted(line["table"] for line in _lines("tables.csv"))


@cache
def published(name: str) -> PublishedTable:
    """A published table. Raises BenchError for a name that there is none of."""
    about = {line["table"]: line for line in _lines("tables.csv")}
    if name not in about:
        raise BenchError(f"there is no published table {name!r}; there are {', '.join(names())}")
    columns: dict[Column, None] = {}
    rows: dict[str, dict[str, Number]] = {}
    for line in (line for file in PAPERS for line in _lines(file) if line["table"] == name):
        column = Column(line["column"], *(line[each.name] for each in fields(Column)[1:]))
        columns[column] = None
        if line["row"]:
            facts = (line[key] for key in ("value", "spread", "origin", "method", "note"))
            rows.setdefault(line["row"], {})[column.label] = Number(*facts)
    return PublishedTable(
        name=name,
        title=about[name]["title"],
        source=about[name]["source"],
        columns=tuple(columns),
        rows=rows,
        notes=tuple(line["note"] for line in _lines("notes.csv") if name in line["tables"].split()),
        clips=int(about[name]["clips"] or 0),
        task=about[name]["task"],
    )


def of_rows(
    tables: Sequence[str], rows: Iterable[str], title: str, notes: Sequence[str], digits: int
) -> PublishedTable:
    """Rows of published tables side by side, in the columns that any data can fill.

    rows: their labels; those that no table has are without printed numbers. digits: of ours.
    Raises BenchError for tables that there are none of.
    """
    columns, rows_by_label = [], {row: dict[str, Number]() for row in rows}
    for table in map(published, tables):
        for column in table.columns:
            if not column.value_id or column.chosen_by != "splits":
                continue
            columns.append(replace(column, block="", repeats=""))
            for row in rows_by_label:
                if number := table.rows.get(row, {}).get(column.repeats or column.label):
                    rows_by_label[row][column.label] = number
    source = ", ".join(published(table).source for table in tables)
    return PublishedTable(
        " ".join(tables), title, source, tuple(columns), rows_by_label, tuple(notes), digits=digits
    )
