"""Tables for other programs, as CSV and JSON: full precision, all that belongs to a number beside it."""

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from retarget_bench.errors import printable
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
    structures = ["structure"] if any(group.structure for _, group in groups) else []
    about = ["value", parts] if parts else ["method", "not_ranked"]
    aspects = [name for key in columns for name in (key, *(f"{key}:{each}" for each in ASPECTS))]
    lines: list[list[object]] = [["dataset", "split", *structures, *about, *aspects, "n"]]
    for table, group in groups:
        of = f"{group.structure}, kind {group.kind}" if group.kind else group.structure
        for row in group.rows:
            named = [group.subject, row.label] if parts else [row.label, row.mark]
            cells = {_id(column): cell for column, cell in zip(group.columns, row.cells, strict=True)}
            numbers = [each for key in columns for each in _facts(cells.get(key, NO_CELL))]
            lines.append([table.title, group.split, *[of for _ in structures], *named, *numbers, row.n])
    return spreadsheet(lines, csv.QUOTE_ALL)


def _id(column: Column) -> str:
    """The id, after its split in tables of several."""
    return f"{column.split}/{column.id}" if column.split else column.id


def _facts(cell: Cell) -> list[str]:
    """The value and its ``ASPECTS``."""
    ends = (cell.interval.low, cell.interval.high) if cell.interval else (None, None)
    value, low, high, spread = (
        "" if each is None else f"{each:.9g}" for each in (cell.value, *ends, cell.spread)
    )
    mark = cell.mark or ("" if value else cell.text)
    return [value, low, high, mark, f"{cell.n or ''}", f"{cell.clips or ''}", spread]


def json_document(tables: Sequence[Table]) -> str:
    """A list of tables, with the fields of ``tables.model``: every cell of a row stands at the place of its
    column. Numbers that are not finite are null."""
    return json.dumps([_plain(asdict(table)) for table in tables], indent=1, ensure_ascii=False) + "\n"


def _plain(content: Any) -> Any:
    """The content in types of JSON, with texts that are safe to print."""
    match content:
        case str():
            return printable(content)
        case dict():
            return {printable(key): _plain(each) for key, each in content.items()}
        case list() | tuple() | set() | frozenset():
            return [_plain(each) for each in content]
        case float() if not math.isfinite(content):
            return None
    return content
