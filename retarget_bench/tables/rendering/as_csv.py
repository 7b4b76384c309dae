"""Tables as CSV, for other programs: full precision, with interval, mark and counts beside every number."""

import csv
from collections.abc import Sequence

from retarget_bench.files import spreadsheet
from retarget_bench.tables.model import Cell, Column, Table

ASPECTS = ("low", "high", "mark", "n", "clips", "seeds_sd")
"""Columns ``<value id>:<aspect>`` stand beside every ``<value id>``."""
NO_CELL = Cell("")


def comma_separated(tables: Sequence[Table]) -> str:
    """One line per row and group. A missing value is empty, and its ``:mark`` is the kind."""
    columns = list(dict.fromkeys(_id(column) for table in tables for column in table.columns))
    groups = [(table, group) for table in tables for group in table.groups]
    parts = next((group.heading for _, group in groups if group.subject), "")
    structures = any(group.structure for _, group in groups)
    about = ["value", parts] if parts else ["method", "not_ranked"]
    about = ["structure", *about] if structures else about
    aspects = [name for key in columns for name in (key, *(f"{key}:{each}" for each in ASPECTS))]
    lines: list[list[object]] = [["dataset", "split", *about, *aspects, "n"]]
    for table, group in groups:
        for row in group.rows:
            mark = f"on the cases of {row.beside}" if row.beside else row.mark
            named = [group.subject, row.label] if parts else [row.label, mark]
            of = f"{group.structure}, kind {group.kind}" if group.kind else group.structure
            named = [of, *named] if structures else named
            cells = {_id(c): cell for c, cell in zip(group.columns, row.cells, strict=True)}
            numbers = [each for key in columns for each in _parts(cells.get(key, NO_CELL))]
            lines.append([table.title, group.split, *named, *numbers, row.n])
    return spreadsheet(lines, csv.QUOTE_ALL)


def _id(column: Column) -> str:
    """The id, after its split in tables of several."""
    return f"{column.split}/{column.id}" if column.split else column.id


def _parts(cell: Cell) -> list[str]:
    low, high = (cell.interval.low, cell.interval.high) if cell.interval else (None, None)
    numbers = [_number(each) for each in (cell.value, low, high)]
    mark = cell.mark or (cell.text if cell.value is None else "")
    counts = [str(each) if each else "" for each in (cell.n, cell.clips)]
    return [*numbers, mark, *counts, _number(cell.spread)]


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.9g}"
