"""Every number printed in the three papers, from the one place in the repository that holds it.

Tables of results are in ``retarget_bench/tables/published``. Tables of ablations are offered by the method
that they are of (``retarget_bench/training/ablation.py``).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from retarget_bench.plugins import registry
from retarget_bench.tables.published import published_tables
from retarget_bench.tables.published.layout import decimals
from retarget_bench.tables.published.published_tables import PublishedColumn, PublishedTable
from retarget_bench.training.ablation import Ablation

REPEATS = {"humot losses", "smrm table2", "smrm table3"}
"""Ablations whose printed numbers are those of published tables."""


@dataclass(frozen=True)
class PrintedNumber:
    """As printed. spread: after the sign ±, or None. text: with the paper's digits."""

    value: float
    spread: float | None
    text: str


@dataclass(frozen=True)
class PrintedColumn:
    """id, label and unit of a column.

    parts:   labels of the columns that it is the mean of, if it is one.
    other:   label of the column of our tables that is the same over other pairs, or "".
    missing: why there is no number of ours, or "".
    """

    id: str
    label: str
    unit: str
    parts: tuple[str, ...] = ()
    other: str = ""
    missing: str = ""


@dataclass(frozen=True)
class PrintedTable:
    """name: of the published table, or ``METHOD ABLATION``. heading: of our tables with its rows.
    rows: row -> column -> number."""

    name: str
    title: str
    heading: str
    columns: tuple[PrintedColumn, ...]
    rows: Mapping[str, Mapping[str, PrintedNumber]]


def names() -> list[str]:
    """Names of all tables."""
    ablations = [
        f"{entry.name} {key}"
        for entry in registry.names("methods")
        for key in getattr(registry.load("methods", entry.name), "ablations", {})
    ]
    return [*published_tables.names(), *(each for each in ablations if each not in REPEATS)]


def table(name: str) -> PrintedTable:
    """A table. Raises BenchError for a name that there is none of."""
    method, _, key = name.partition(" ")
    if key:
        plugin: Any = registry.load("methods", method)
        return _of_ablation(name, plugin.ablations[key])
    return _of_published(name, published_tables.published(name))


def _of_published(name: str, table: PublishedTable) -> PrintedTable:
    columns = [each for each in table.columns if not each.block]
    rows = {
        row.method: {
            each.id: _number(row.values[each.id], decimals(table, each))
            for each in columns
            if each.id in row.values
        }
        for row in table.rows
    }
    shown = tuple(_column(table, each) for each in columns)
    return PrintedTable(name, table.title, table.title, shown, rows)


def _column(table: PublishedTable, column: PublishedColumn) -> PrintedColumn:
    labels = {each.id: each.label for each in table.columns}
    parts = tuple(labels[each] for each in column.mean_of)
    other = next((each.label for each in table.columns if each.repeats == column.id), "")
    return PrintedColumn(column.id, column.label, column.unit, parts, other, column.missing)


def _of_ablation(name: str, ablation: Ablation) -> PrintedTable:
    columns = tuple(
        PrintedColumn(each.label, each.label, each.unit, missing=each.missing) for each in ablation.columns
    )
    rows = {
        row.label: {label: PrintedNumber(float(text), None, text) for label, text in row.printed.items()}
        for row in ablation.rows
        if row.printed
    }
    which = ablation.paper.rpartition(", ")[2]
    return PrintedTable(name, f"{which}, {ablation.title}", ablation.title, columns, rows)


def _number(given: tuple[float, ...], digits: int) -> PrintedNumber:
    value, spread = (*given, None)[:2]
    assert value is not None
    text = f"{value:,.{digits}f}" + ("" if spread is None else f" ±{spread:.{digits}f}")
    return PrintedNumber(value, spread, text)
