"""Tables as Markdown: best in bold, intervals on request."""

from collections.abc import Sequence

from retarget_bench.tables.model import MARKS, Cell, Group, Row, Table
from retarget_bench.tables.rendering import words

SPECIAL = "\\`*_[]|~$#!"


def markdown(tables: Sequence[Table], intervals: bool = False) -> str:
    """A Markdown table per group, with a legend, footnotes and notes."""
    return "\n".join(_table(table, intervals) for table in tables)


def plain(sentence: str) -> str:
    """Text escaped for Markdown and the HTML in it."""
    escaped = words.printable(sentence).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return "".join(f"\\{each}" if each in SPECIAL else each for each in escaped)


def line(cells: Sequence[str]) -> str:
    """A line of a table."""
    return f"| {' | '.join(cells)} |"


def _table(table: Table, intervals: bool) -> str:
    out = [f"## {plain(table.title)}"]
    for group in table.groups:
        out += ["", f"### {plain(group.title)}", ""]
        out += _group(group, intervals) if group.columns else [words.NO_COLUMN]
    return "\n".join([*out, "", *_legend(table, intervals)]) + "\n"


def _group(group: Group, intervals: bool) -> list[str]:
    heads = []
    for column in group.columns:
        unit = words.shown_unit(column)
        below = [unit, f"({column.mark})" if column.mark else ""]
        head = [f"{column.label} {column.arrow}".strip(), *(each for each in below if each)]
        heads.append("<br>".join(map(plain, head)))
    out = [line([plain(group.heading), *heads, "n"]), "|---|" + "---:|" * (len(heads) + 1)]
    out += [_line(row, intervals) for row in group.ranked]
    if counts := words.common_counts(group):
        out.append(line([f"*{words.COMMON}*", *counts, ""]))
    return [*out, *(_line(row, intervals) for row in group.unranked)]


def _line(row: Row, intervals: bool) -> str:
    cells = [_cell(cell, intervals) for cell in row.cells]
    return line([plain(words.named(row)), *cells, plain(row.n)])


def _cell(cell: Cell, intervals: bool) -> str:
    shown = f"**{cell.text}**" if cell.mark == "best" else cell.text
    shown += f" {MARKS['tied']}" if cell.mark == "tied" else ""
    shown += f" \\[{cell.footnote}\\]" if cell.footnote else ""
    shown += f"<br>{cell.between}" if intervals and cell.between else ""
    return shown + (f"<br>±{cell.between_seeds}" if cell.spread is not None else "")


def _legend(table: Table, intervals: bool) -> list[str]:
    out = [plain(f"{table.reading or words.MEANS} {words.ARROWS}")]
    if words.has_marks([table]):
        out.append(f"**Bold**: {plain(words.BEST)}. {MARKS['tied']} {plain(words.TIED)}.")
    out += [plain(words.INTERVALS)] if intervals else []
    out += [plain(words.SEEDS)] if words.has_seeds([table]) else []
    out += ["", *(f"- **{plain(label)}**: {plain(meaning)}" for label, meaning in words.meanings(table))]
    out += [f"- \\[{number}\\] {plain(note)}" for number, note in enumerate(table.footnotes, 1)]
    return [*out, *(f"- {plain(note)}" for note in words.notes(table))]
