"""Tables as aligned text, at most ``WIDTH`` wide, with intervals on request."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from retarget_bench.tables.model import MARKS, Cell, Column, Group, Row, Table
from retarget_bench.tables.rendering import words
from retarget_bench.tables.rendering.words import printable, width, wrapped

WIDTH = 108
MOST_COLUMNS = 8
"""Tables with more columns than this, and than rows, are transposed."""
WIDEST_HEAD, WIDEST_WORD = 9, 22
NARROWEST_NAME, WIDEST_NAME = 24, 40


@dataclass(frozen=True)
class _Line:
    """A name and the stacked lines of every column; without these a heading."""

    name: str
    cells: tuple[tuple[str, ...], ...] = ()


def text(tables: Sequence[Table], intervals: bool = False) -> str:
    """Each table with its legend, footnotes and notes. ``intervals``: on a line below the means."""
    return "\n".join(_table(table, intervals) for table in tables)


def _table(table: Table, intervals: bool) -> str:
    title = printable(table.title)
    out = [title, "=" * width(title)]
    for group in table.groups:
        out += ["", *_hung("", printable(group.title)), ""]
        if not group.columns:
            out.append(f"  {words.NO_COLUMN}")
        elif len(group.columns) > max(MOST_COLUMNS, len(group.rows)):
            out += _by_column(group, intervals)
        else:
            out += _by_row(group, intervals)
    return "\n".join([*out, "", *_legend(table, intervals)]) + "\n"


def _by_row(group: Group, intervals: bool) -> list[str]:
    """A line per row of the group."""

    def line(row: Row) -> _Line:
        cells = (*(_stacked(cell, intervals) for cell in row.cells), (row.n,))
        return _Line(words.named(row), cells)

    lines = [line(row) for row in group.ranked]
    if counts := words.common_counts(group):
        lines.append(_Line(f"({words.COMMON})", (*((f"{each} ",) for each in counts), ("",))))
    if group.unranked:
        lines += [_Line(f"{words.NOT_RANKED}:"), *map(line, group.unranked)]
    return _grid(group.heading, [*map(_head, group.columns), ["n"]], lines)


def _by_column(group: Group, intervals: bool) -> list[str]:
    """A line per column of the group; why a row is not ranked stands below its name."""
    heads = []
    for row in group.rows:
        mark = wrapped(printable(f"({row.mark})"), WIDEST_WORD) if row.mark else []
        heads.append([*wrapped(printable(row.label), WIDEST_WORD), *mark])
    lines = []
    for number, column in enumerate(group.columns):
        unit = words.shown_unit(column)
        name = f"{column.id} {column.arrow}".strip() + (f" [{unit}]" if unit else "")
        name += f" ({column.mark})" if column.mark else ""
        lines.append(_Line(name, tuple(_stacked(row.cells[number], intervals) for row in group.rows)))
    lines.append(_Line("n", tuple((f"{row.n} ",) for row in group.rows)))
    return _grid("", heads, lines)


def _stacked(cell: Cell, intervals: bool) -> tuple[str, ...]:
    """Number, mark and footnote; below them the interval and the spread over seeds."""
    footnote = f" [{cell.footnote}]" if cell.footnote else ""
    mark = MARKS[cell.mark] or ("" if footnote else " ")
    first = f"{cell.text}{mark}{footnote}"
    below = [f"{cell.between} "] if intervals and cell.between else []
    return (first, *below, *([f"±{cell.between_seeds} "] if cell.spread is not None else []))


def _head(column: Column) -> list[str]:
    """A column's heading: its words below each other, the arrow with the last, then its unit and mark."""
    *start, end = printable(column.label).split(" ")
    lines = textwrap.wrap(" ".join(start), WIDEST_HEAD) if start else []
    unit = textwrap.wrap(printable(words.shown_unit(column)), WIDEST_HEAD)
    mark = wrapped(printable(f"({column.mark})"), WIDEST_WORD) if column.mark else []
    return [*lines, *wrapped(f"{end} {column.arrow}".strip(), WIDEST_WORD), *unit, *mark]


# ------------------------------------------------------------------------------------------------ grid
def _grid(heading: str, heads: Sequence[list[str]], lines: Sequence[_Line]) -> list[str]:
    """Aligned columns; as many blocks below each other as the width asks for."""
    rows = [line for line in lines if line.cells]
    widths = [
        2 + max(width(part) for parts in (head, *(line.cells[i] for line in rows)) for part in parts)
        for i, head in enumerate(heads)
    ]
    longest = max(width(printable(line.name)) for line in lines)
    room = WIDTH - 2 - sum(widths)
    first = min(longest, room if room >= NARROWEST_NAME else WIDEST_NAME)
    out: list[str] = []
    for block in _blocks(widths, WIDTH - 2 - first):
        tall = max(len(heads[i]) for i in block)
        tops = [[""] * (tall - len(heads[i])) + heads[i] for i in block]
        out += [""] if out else []
        for number, each in enumerate(zip(*tops, strict=True)):
            name = heading if number == tall - 1 else ""
            out.append(_joined(name, each, first, [widths[i] for i in block]))
        for line in lines:
            out += _body(line, block, first, widths)
    return out


def _blocks(widths: Sequence[int], room: int) -> list[list[int]]:
    """Numbers of columns that fit beside each other; at least one in each block."""
    blocks: list[list[int]] = [[]]
    for number, each in enumerate(widths):
        if blocks[-1] and sum(widths[i] for i in blocks[-1]) + each > room:
            blocks.append([])
        blocks[-1].append(number)
    return blocks


def _body(line: _Line, block: Sequence[int], first: int, widths: Sequence[int]) -> list[str]:
    if not line.cells:
        return [f"  {line.name}"]
    names = wrapped(printable(line.name), first)
    cells = [line.cells[i] for i in block]
    tall = max(len(names), *(len(each) for each in cells))
    rows = zip(*([*each, *[""] * (tall - len(each))] for each in (names, *cells)), strict=True)
    return [_joined(name, row, first, [widths[i] for i in block]) for name, *row in rows]


def _joined(name: str, cells: Sequence[str], first: int, widths: Sequence[int]) -> str:
    body = "".join(" " * (w - width(cell)) + cell for cell, w in zip(cells, widths, strict=True))
    return f"  {name}{' ' * (first - width(name))}{body}".rstrip()


# ---------------------------------------------------------------------------------------------- legend
def _legend(table: Table, intervals: bool) -> list[str]:
    out = _hung("", f"{table.reading or words.MEANS} {words.ARROWS}")
    if words.has_marks([table]):
        out += _hung("", f"{MARKS['best']} {words.BEST}; {MARKS['tied']} {words.TIED}.")
    if intervals:
        out += _hung("", words.INTERVALS)
    if words.has_seeds([table]):
        out += _hung("", words.SEEDS)
    meanings = [(printable(label), printable(meaning)) for label, meaning in words.meanings(table)]
    most = min(max(width(label) for label, _ in meanings), WIDEST_NAME)
    for label, meaning in meanings:
        if width(label) > most:
            out += [f"  {line}" for line in wrapped(label, WIDTH - 2)]
            label = ""
        out += _hung(f"  {label}{' ' * (most - width(label))}  ", meaning)
    for number, footnote in enumerate(table.footnotes, 1):
        out += _hung(f"[{number}] ", printable(footnote))
    return [*out, *(line for note in words.notes(table) for line in _hung("- ", printable(note)))]


def _hung(lead: str, sentence: str) -> list[str]:
    return textwrap.wrap(sentence, WIDTH, initial_indent=lead, subsequent_indent=" " * len(lead)) or [lead]
