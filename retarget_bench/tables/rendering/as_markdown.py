"""Tables as Markdown: best in bold, intervals on request."""

from collections.abc import Iterable, Sequence

from retarget_bench.errors import printable
from retarget_bench.tables.model import MARKS, Cell, Group, Row, Table
from retarget_bench.tables.rendering import words

SPECIAL = "\\`*_[]|~$#!"


def markdown(tables: Sequence[Table], intervals: bool = False, *, notes: bool = True) -> str:
    """A Markdown table per group, with a legend, footnotes and, with ``notes``, all notes."""
    return "\n".join(_table(table, intervals, notes) for table in tables)


def plain(sentence: str) -> str:
    """Text escaped for Markdown and the HTML in it."""
    escaped = printable(sentence).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return "".join(f"\\{each}" if each in SPECIAL else each for each in escaped)


def line(cells: Iterable[str]) -> str:
    """A line of a table."""
    return f"| {' | '.join(cells)} |"


def _table(table: Table, intervals: bool, notes: bool) -> str:
    out = [f"## {plain(table.title)}"]
    for group in table.groups:
        out += ["", f"### {plain(group.title)}", ""]
        out += _group(group, intervals) if group.columns else [words.NO_COLUMN]
        out += [line for each in group.below for line in ("", plain(each))]
    out.append("")
    for lead, sentence in words.legend(table, notes, intervals):
        shown = plain(f"{lead.strip(' -')} {sentence}".strip()).replace("\\* best", "**Bold** best", 1)
        out += [f"- {shown}"] if lead else [shown, ""]
    return "\n".join(out).rstrip() + "\n"


def _group(group: Group, intervals: bool) -> list[str]:
    heads = []
    for column in group.columns:
        mark = f"({column.mark})" if column.mark else ""
        head = (column.split, f"{column.label} {column.arrow}".strip(), words.shown_unit(column), mark)
        heads.append("<br>".join(plain(each) for each in head if each))
    last = ["n"] if group.counts else []
    out = [line([plain(group.heading), *heads, *last]), "|---|" + "---:|" * len([*heads, *last])]
    for heading, rows in group.blocks:
        if heading:
            out.append(line([f"*{plain(heading)}*", *("" for _ in [*heads, *last])]))
        out += [_line(row, group, intervals) for row in rows]
    if counts := words.common_counts(group):
        out.append(line([f"*{words.COMMON}*", *counts, *("" for _ in last)]))
    return out


def _line(row: Row, group: Group, intervals: bool) -> str:
    cells = [_cell(cell, intervals) for cell in row.cells]
    return line([plain(words.row_name(row)), *cells, *([plain(row.n)] if group.counts else [])])


def _cell(cell: Cell, intervals: bool) -> str:
    shown = f"**{cell.text}**" if cell.mark == "best" else cell.text
    shown += f" {MARKS['tied']}" if cell.mark == "tied" else ""
    shown += f" \\[{cell.footnote}\\]" if cell.footnote else ""
    shown += f"<br>{cell.between}" if intervals and cell.between else ""
    return shown + (f"<br>±{cell.between_seeds}" if cell.spread is not None else "")
