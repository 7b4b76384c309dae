"""Tables as one self-contained HTML page with sortable columns, readable without scripts too."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget_bench.errors import printable
from retarget_bench.tables.model import MARKS, Cell, Column, Table, count
from retarget_bench.tables.rendering import words

if TYPE_CHECKING:
    from jinja2 import Environment

PAGES = Path(__file__).parent / "pages"
BEST_FIRST = {"lower": "ascending", "higher": "descending", "target": "other", "none": "ascending"}
"""``aria-sort`` order of a column in which the best come first."""
UNRANKED = 1e4
"""Added to the keys of cells that are not ranked, where places are keys."""
MOST_CASES = 5
"""Cases without an answer that are named for each reason."""


def html(tables: Sequence[Table]) -> str:
    """One page with all tables, how to read them, what their columns mean and where they come from."""
    return environment().get_template("tables.html").render(context(tables))


def fragment(tables: Sequence[Table]) -> str:
    """The tables as part of another page, such as a notebook: without script, with a style of their own."""
    return environment().get_template("fragment.html").render(context(tables))


def context(tables: Sequence[Table]) -> dict[str, Any]:
    """The context of the table templates."""
    return {
        "tables": tables,
        "words": words,
        "marks": MARKS,
        "has_intervals": any(cell.interval for table in tables for cell in table.cells),
        "has_parts": any(group.subject for table in tables for group in table.groups),
        "best_first": BEST_FIRST,
        "most_cases": MOST_CASES,
        "sort_key": sort_key,
        "tooltip": tooltip,
    }


@cache
def environment() -> Environment:
    """Template environment; all values are escaped and made printable."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(PAGES, encoding="utf-8"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_finalize,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _finalize(value: Any) -> Any:
    return printable(value) if type(value) is str else value


def sort_key(cell: Cell, column: Column) -> str:
    """Sort key of a cell: the better, the smaller.

    A mean may be nearer to its goal than that of a method whose cases are nearer on average, so where a
    column has a goal ranked cells are sorted by their place, and others after them by their mean.
    """
    value = cell.value or 0.0
    if column.better != "target":
        return f"{-value if column.better == 'higher' else value:.9g}"
    if cell.place is not None:
        return f"{cell.place}"
    ratio = value / column.goal
    return f"{UNRANKED + abs(math.log(ratio)):.9g}" if ratio > 0 else "Infinity"


def tooltip(cell: Cell, column: Column) -> str:
    """Tool tip of a cell."""
    if cell.value is None:
        return cell.reason or cell.text
    parts = [{"": "", "best": words.BEST, "tied": words.TIED}[cell.mark]]
    if cell.n:
        of_sets = column.label == "FID"  # of all answers as one set, beside means over cases
        windows = f"over {count(cell.n, 'window')} of {count(cell.clips, 'clip')}"
        parts.append(windows if of_sets else f"mean over {words.clips_and_cases(cell.clips, cell.n)}")
    if cell.interval:
        parts.append(f"interval {cell.between}")
    return "; ".join(part for part in (*parts, cell.reason) if part)
