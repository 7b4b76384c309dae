"""A Table as text for a terminal, as Markdown, or as CSV."""

from __future__ import annotations

import csv
import io
import textwrap
from collections.abc import Callable, Sequence

from retarget_bench.table import NOTHING, Row, Table

WIDTH = 108
CONTROLS = "not ranked"


def text(table: Table) -> str:
    """For a terminal: aligned columns, then what each column means, then the notes."""
    heads = [" ".join(filter(None, (column.label, column.arrow))) for column in table.columns]
    units = [column.unit if column.unit != "1" else "" for column in table.columns]
    rows = [row for group in table.groups for row in (*group.ranked, *group.unranked)]
    first = max([len(_named(row)) for row in rows] + [len("method")]) + 2
    widths = [
        max([len(head), len(unit)] + [len(row.cells[i].text) for row in rows]) + 2
        for i, (head, unit) in enumerate(zip(heads, units, strict=True))
    ]
    last = max([len(row.n) for row in rows] + [1]) + 2

    def line(label: str, cells: Sequence[str], n: str) -> str:
        body = "".join(cell.rjust(width) for cell, width in zip(cells, widths, strict=True))
        return f"  {label:<{first}}{body}{n:>{last}}".rstrip()

    out = [table.title, "=" * len(table.title)]
    for group in table.groups:
        out += ["", group.title, line("method", heads, "n"), line("", units, "")]
        out += [line(_named(row), [cell.text for cell in row.cells], row.n) for row in group.ranked]
        if group.unranked:
            out.append(f"  {CONTROLS}:")
            out += [line(_named(row), [cell.text for cell in row.cells], row.n) for row in group.unranked]
    out += [
        "",
        "Columns (↓ less is better, ↑ more is better, →1 best at 1); means over clips of the mean per clip",
    ]
    labels = max((len(column.label) for column in table.columns), default=0)
    for column in table.columns:
        out += _hung(f"  {column.label:<{labels}}  ", column.meaning)
    out += _hung(
        f"  {'n':<{labels}}  ", "cases that the method answered (of those asked, where it is fewer)"
    )
    if any(cell.text == NOTHING for row in rows for cell in row.cells):
        out += _hung(f"  {NOTHING:<{labels}}  ", "does not apply to these cases")
    for note in table.notes:
        out += _hung("* ", note)
    return "\n".join(out) + "\n"


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
            for c in table.columns
        ]
        out += ["", f"### {_plain(group.title)}", ""]
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
            numbers = ["" if cell.value is None else f"{cell.value:.9g}" for cell in row.cells]
            writer.writerow([table.title, split, row.label, row.mark, *numbers, row.n])
    return out.getvalue()


RENDERERS: dict[str, Callable[[Table], str]] = {"text": text, "md": markdown, "csv": comma_separated}
