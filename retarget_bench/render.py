"""A Table as text for a terminal, as Markdown, or as CSV."""

from __future__ import annotations

import csv
import io
import textwrap
from collections.abc import Callable, Sequence

from retarget_bench.table import NOTHING, Column, Group, Row, Table

WIDTH = 108
MOST_COLUMNS = 8
"""More than these are shown as lines."""
CONTROLS = "not ranked"
NO_COLUMN = "no case here has any of the values asked for"
LEGEND = "Means over clips of the mean per clip. ↓ less is better, ↑ more is better, →1 best at 1."
N_MEANS = "cases that the method answered, out of those asked where it did not answer all"


def text(table: Table) -> str:
    """For a terminal: aligned columns (a line per value where they are many), what each means, notes."""
    rows = [row for group in table.groups for row in (*group.ranked, *group.unranked)]
    first = max(len("method"), *(len(_named(row)) for row in rows))
    few = all(len(group.columns) <= MOST_COLUMNS for group in table.groups)
    out = [table.title, "=" * len(table.title)]
    for group in table.groups:
        if not group.columns:
            lines = [f"  {NO_COLUMN}"]
        else:
            lines = _lines_by_method(group, first) if few else _lines_by_value(group)
        out += ["", group.title, "", *lines]
    return "\n".join([*out, "", *_legend(table, rows, short=few)]) + "\n"


def _lines_by_method(group: Group, first: int) -> list[str]:
    """A line per method; ``first`` is the width of the names."""
    rows = (*group.ranked, *group.unranked)
    heads = [_head(column) for column in group.columns]
    widths = [
        2 + max(len(words) for words in (*head, *(row.cells[i].text for row in rows)))
        for i, head in enumerate(heads)
    ]
    last = 4 + max(len(row.n) for row in rows)

    def line(label: str, cells: Sequence[str], n: str) -> str:
        body = "".join(cell.rjust(width) for cell, width in zip(cells, widths, strict=True))
        return f"  {label:<{first}}{body}{n:>{last}}".rstrip()

    tops, names, units = zip(*heads, strict=True)
    out = [line("", tops, ""), line("method", names, "n"), line("", units, "")]
    out += [line(_named(row), [cell.text for cell in row.cells], row.n) for row in group.ranked]
    if group.unranked:
        out.append(f"  {CONTROLS}:")
        out += [line(_named(row), [cell.text for cell in row.cells], row.n) for row in group.unranked]
    return out


def _lines_by_value(group: Group) -> list[str]:
    """A line per value, a column per method; those that are not ranked in parentheses."""
    shown = [(row.label, row) for row in group.ranked]
    shown += [(f"({row.label})", row) for row in group.unranked]
    names = [
        f"{column.id} {column.arrow}".strip() + (f" [{column.unit}]" if column.unit != "1" else "")
        for column in group.columns
    ]
    first = max(map(len, names))
    widths = [2 + max(len(label), *(len(cell.text) for cell in row.cells)) for label, row in shown]
    out = [
        f"  {'':<{first}}" + "".join(f"{label:>{w}}" for (label, _), w in zip(shown, widths, strict=True))
    ]
    for number, name in enumerate(names):
        cells = (row.cells[number].text for _, row in shown)
        out.append(f"  {name:<{first}}" + "".join(f"{c:>{w}}" for c, w in zip(cells, widths, strict=True)))
    counts = (row.n for _, row in shown)
    out.append(f"  {'n':<{first}}" + "".join(f"{n:>{w}}" for n, w in zip(counts, widths, strict=True)))
    return out


def _head(column: Column) -> tuple[str, str, str]:
    """A column's heading: its words on two lines, its unit on a third."""
    *start, end = column.label.split(" ")
    unit = column.unit if column.unit != "1" else ""
    return " ".join(start), f"{end} {column.arrow}".strip(), unit


def _legend(table: Table, rows: Sequence[Row], *, short: bool) -> list[str]:
    out = [LEGEND]
    meanings = [(c.label if short else c.id, c.meaning) for c in table.columns] + [("n", N_MEANS)]
    if any(cell.text == NOTHING for row in rows for cell in row.cells):
        meanings.append((NOTHING, "does not apply to these cases"))
    labels = max(len(label) for label, _ in meanings)
    for label, meaning in meanings:
        out += _hung(f"  {label:<{labels}}  ", meaning)
    for note in table.notes:
        out += _hung("* ", note)
    return out


def _hung(lead: str, words: str) -> list[str]:
    return textwrap.wrap(words, WIDTH, initial_indent=lead, subsequent_indent=" " * len(lead))


def _named(row: Row) -> str:
    return f"{row.label} ({row.mark})" if row.mark else row.label


def markdown(table: Table) -> str:
    """A Markdown table per split, with a legend and the notes."""
    out = [f"## {_plain(table.title)}"]
    for group in table.groups:
        heads = [
            _plain(f"{c.label} {c.arrow}".strip()) + (f"<br>{_plain(c.unit)}" if c.unit != "1" else "")
            for c in group.columns
        ]
        out += ["", f"### {_plain(group.title)}", ""]
        if not group.columns:
            out.append(NO_COLUMN)
            continue
        out.append("| method | " + " | ".join([*heads, "n"]) + " |")
        out.append("|---|" + "---:|" * (len(heads) + 1))
        for row in (*group.ranked, *group.unranked):
            cells = [cell.text for cell in row.cells]
            out.append("| " + " | ".join([_plain(_named(row)), *cells, row.n]) + " |")
    out += ["", *(f"- **{_plain(c.label)}**: {_plain(c.meaning)}" for c in table.columns)]
    out += [f"- {_plain(note)}" for note in table.notes]
    return "\n".join(out) + "\n"


def _plain(words: str) -> str:
    """Text that Markdown and the HTML in it leave alone."""
    escaped = words.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    for mark in "\\`*_[]|":
        escaped = escaped.replace(mark, "\\" + mark)
    return escaped


def comma_separated(table: Table) -> str:
    """One line per method and split; full precision; empty where there is no number."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["dataset", "split", "method", "not_ranked", *(c.id for c in table.columns), "n"])
    for group in table.groups:
        split = group.title.split(":")[0]
        for row in (*group.ranked, *group.unranked):
            cells = {c.id: cell.value for c, cell in zip(group.columns, row.cells, strict=True)}
            values = (cells.get(c.id) for c in table.columns)
            numbers = ["" if value is None else f"{value:.9g}" for value in values]
            writer.writerow([table.title, split, row.label, row.mark, *numbers, row.n])
    return out.getvalue()


RENDERERS: dict[str, Callable[[Table], str]] = {"text": text, "md": markdown, "csv": comma_separated}
