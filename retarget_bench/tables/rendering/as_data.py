"""Tables for other programs, as CSV and JSON: full precision, all that belongs to a number beside it."""

import csv
import json
import math
from collections.abc import Sequence
from typing import Any

from retarget_bench.errors import printable
from retarget_bench.files import spreadsheet
from retarget_bench.tables.model import Cell, Column, Group, Row, Table

ASPECTS = ("low", "high", "mark", "n", "clips", "seeds_sd")
"""Columns ``<value id>:<aspect>`` stand beside every ``<value id>``."""
NO_CELL = Cell("")


# ------------------------------------------------------------------------------------------------- CSV
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
            named = [group.subject, row.label] if parts else [row.label, row.mark]
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


# ------------------------------------------------------------------------------------------------ JSON
def json_document(tables: Sequence[Table]) -> str:
    """A list of tables; each has ``groups`` with ``columns`` and ``rows``, whose ``cells`` stand under the
    ids of the columns (``split/id`` where a group has several splits)."""
    return json.dumps([_table(table) for table in tables], indent=1, ensure_ascii=False) + "\n"


def _table(table: Table) -> dict[str, Any]:
    sentences = (*table.notes, *(problem.sentence for problem in table.problems), *table.hints)
    return {
        "title": printable(table.title),
        "data": {fact: printable(value) for fact, value in table.data},
        "finding": printable(table.finding),
        "groups": [_group(group) for group in table.groups],
        "notes": [printable(each) for each in (table.reading, *sentences) if each],
    }


def _group(group: Group) -> dict[str, Any]:
    facts = ("label", "unit", "better", "goal", "meaning", "split", "mark")
    return {
        "title": printable(group.title),
        "split": group.split,
        "structure": group.structure,
        "value": group.subject,
        "heading": group.heading,
        "counted": group.counted,
        "columns": {
            _id(column): {each: getattr(column, each) for each in facts} for column in group.columns
        },
        "rows": [_row(row, group) for row in group.rows],
        "notes": [printable(each) for each in group.below],
    }


def _row(row: Row, group: Group) -> dict[str, Any]:
    """``not_ranked``: the reason; "" where the row is ranked."""
    cells = {_id(column): _cell(cell) for column, cell in zip(group.columns, row.cells, strict=True)}
    return {
        "label": printable(row.label),
        "not_ranked": printable(row.mark),
        "learned": row.learned,
        "n": row.n,
        "cells": cells,
    }


def _cell(cell: Cell) -> dict[str, Any]:
    """``value`` is null where there is none, and ``missing`` then the kind; ``place`` counts from 1."""
    low, high = (cell.interval.low, cell.interval.high) if cell.interval else (None, None)
    known = cell.value is not None and math.isfinite(cell.value)
    return {
        "value": cell.value if known else None,
        "missing": "" if known else cell.text,
        "low": low,
        "high": high,
        "mark": cell.mark,
        "place": None if cell.place is None else cell.place + 1,
        "n": cell.n,
        "clips": cell.clips,
        "seeds_sd": cell.spread,
        "reason": printable(cell.reason),
    }
