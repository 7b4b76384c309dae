"""Tables as aligned text for a width, with intervals and all notes on request."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, zip_longest

from retarget_bench.errors import printable
from retarget_bench.tables.model import MARKS, Cell, Column, Group, Row, Table
from retarget_bench.tables.rendering import words
from retarget_bench.tables.rendering.words import filled, to_the_right, width, wrapped

WIDTH = 100
"""Characters in a line of pipes and files."""
MOST_COLUMNS = 9
"""Tables with more columns than this, and than rows, are transposed."""
WIDEST_HEAD, WIDEST_WORD = 9, 22
NARROWEST_NAME, WIDEST_NAME = 24, 40
GAP = 3
"""Between the columns of two splits."""


@dataclass(frozen=True)
class _Line:
    """A name and the stacked lines of every column; without these a heading."""

    name: str
    cells: tuple[tuple[str, ...], ...] = ()


@dataclass(frozen=True)
class _Head:
    """The heading of a column. split: of which it is, where a table has several."""

    lines: tuple[str, ...]
    split: str = ""


def text(
    tables: Sequence[Table], intervals: bool = False, *, notes: bool = False, columns: int = WIDTH
) -> str:
    """Each table with its legend. ``columns``: the width in characters.

    intervals: on a line below the means. notes: how numbers are made in full, and every note.
    """
    page = _Page(columns, intervals, notes)
    return "\n".join(page.table(table) for table in tables)


@dataclass(frozen=True)
class _Page:
    """A width, and what is shown on it."""

    width: int
    intervals: bool
    notes: bool

    def table(self, table: Table) -> str:
        out = []
        for number, group in enumerate(table.groups):
            out += [""] if number else []
            out += self.hung("", printable(group.title))
            if not group.columns:
                out.append(f"  {words.NO_COLUMN}")
            elif len(group.columns) > max(MOST_COLUMNS, len(group.rows)) and group.split:
                out += self.by_column(group)
            else:
                out += self.by_row(group)
            out += [line for each in group.below for line in self.hung("  ", printable(each))]
        return "\n".join([printable(table.title), *out, "", *self.legend(table)]) + "\n"

    def by_row(self, group: Group) -> list[str]:
        """A line per row of the group."""
        heads = [_head(column) for column in group.columns] + ([_Head(("n",))] if group.counts else [])

        def line(row: Row) -> _Line:
            cells = tuple(self.stacked(cell) for cell in row.cells)
            return _Line(words.row_name(row), (*cells, (row.n,)) if group.counts else cells)

        lines, counts = [], words.common_counts(group)
        for heading, rows in group.blocks:
            lines += [_Line(f"-- {heading}:")] if heading else []
            lines += map(line, rows)
            if counts and rows[-1] in group.ranked[-1:]:
                last = (("",),) if group.counts else ()
                lines.append(_Line(f"({words.COMMON})", (*((f"{each} ",) for each in counts), *last)))
        return self.grid(group.heading, heads, lines)

    def by_column(self, group: Group) -> list[str]:
        """A line per column of the group; why a row is not ranked stands below its name."""
        heads = []
        for row in group.rows:
            mark = wrapped(printable(f"({row.mark})"), WIDEST_WORD) if row.mark else []
            heads.append(_Head((*wrapped(printable(row.label), WIDEST_WORD), *mark)))
        lines = []
        for number, column in enumerate(group.columns):
            unit = words.shown_unit(column)
            name = f"{column.id} {column.arrow}".strip() + (f" [{unit}]" if unit else "")
            name += f" ({column.mark})" if column.mark else ""
            lines.append(_Line(name, tuple(self.stacked(row.cells[number]) for row in group.rows)))
        lines.append(_Line("n", tuple((f"{row.n} ",) for row in group.rows)))
        return self.grid("", heads, lines)

    def stacked(self, cell: Cell) -> tuple[str, ...]:
        """Number, mark and footnote; below them the interval and the spread over seeds."""
        footnote = f" [{cell.footnote}]" if cell.footnote else ""
        mark = MARKS[cell.mark] or ("" if footnote else " ")
        first = f"{cell.text}{mark}{footnote}"
        below = [f"{cell.between} "] if self.intervals and cell.between else []
        return (first, *below, *([f"±{cell.between_seeds} "] if cell.spread is not None else []))

    # -------------------------------------------------------------------------------------------- grid
    def grid(self, heading: str, heads: Sequence[_Head], lines: Sequence[_Line]) -> list[str]:
        """Aligned columns; as many blocks below each other as the width asks for."""
        rows = [line for line in lines if line.cells]
        stacks = [[head.lines, *(line.cells[i] for line in rows)] for i, head in enumerate(heads)]
        bare = [max(width(part) for stack in each for part in stack) for each in stacks]
        for i, head in enumerate(heads):
            bare[i] += GAP if head.split and i and head.split != heads[i - 1].split else 0
        names = [printable(heading), *(printable(line.name) for line in rows)]
        first, gap = self._fitting(names, sum(bare), len(bare), any(head.split for head in heads))
        grid = _Grid(heads, first, [each + gap for each in bare])
        out: list[str] = []
        for block in grid.blocks(self.width):
            out += ["", *grid.headings(heading, block)]
            for line in lines:
                if line.cells:
                    out += grid.row(line, block)
                else:
                    out += textwrap.wrap(
                        line.name, self.width, initial_indent="  ", subsequent_indent="     "
                    )
        return out[1:]

    def _fitting(self, names: Sequence[str], occupied: int, columns: int, splits: bool) -> tuple[int, int]:
        """The width of names and the space before columns: as much as fits on the page, or as is needed.

        occupied: the width of so many columns without these spaces.
        """
        longest = max(map(width, names))
        bare = max(width(name.partition(" (")[0]) for name in names)
        narrow = min(longest, bare if splits else max(bare, NARROWEST_NAME))
        for name, gap in ((longest, 2), (longest, 1), (narrow, 1)):
            if 2 + name + occupied + gap * columns <= self.width:
                return name, gap
        return min(longest, WIDEST_NAME), 2

    # ------------------------------------------------------------------------------------------ legend
    def legend(self, table: Table) -> list[str]:
        """The lines below the table; of each method that lacks answers one line, without notes."""
        lines: list[str] = []
        short = set() if self.notes or table.reading else set(words.problem_lines(table))
        for lead, sentence in words.legend(table, self.notes, self.intervals):
            line = printable(sentence)
            if sentence in short:
                lines.append(textwrap.shorten(f"{lead}{line}", self.width, placeholder=" ..."))
            else:
                lines += self.hung(lead, line)
        return lines

    def hung(self, lead: str, sentence: str) -> list[str]:
        return filled(sentence, self.width, lead, " " * len(lead)) or [lead]


def _head(column: Column) -> _Head:
    """A column's heading: its words below each other, the arrow with the last, then its unit and mark."""
    label = "\u00a0".join(filter(None, [printable(column.label), column.arrow]))
    lines = [
        part
        for line in textwrap.wrap(label, WIDEST_HEAD, break_long_words=False)
        for part in wrapped(line.replace("\u00a0", " "), WIDEST_WORD)
    ]
    unit = textwrap.wrap(printable(words.shown_unit(column)), WIDEST_HEAD)
    mark = wrapped(printable(f"({column.mark})"), WIDEST_WORD) if column.mark else []
    return _Head((*lines, *unit, *mark), column.split)


@dataclass(frozen=True)
class _Grid:
    """Columns beside each other. first: the width of names; widths: of columns, with the space before."""

    heads: Sequence[_Head]
    first: int
    widths: Sequence[int]

    def spans(self, block: Sequence[int]) -> list[tuple[str, list[int]]]:
        """The columns of each split that follow each other."""
        return [(split, list(each)) for split, each in groupby(block, key=lambda i: self.heads[i].split)]

    def blocks(self, most: int) -> list[list[int]]:
        """Numbers of columns that fit beside each other on so wide a page; at least one in each block.

        Columns of several splits stand side by side where all fit, otherwise one split at a time.
        """
        everything, room = list(range(len(self.widths))), most - 2 - self.first
        if sum(self.widths) <= room:
            return [everything]
        blocks: list[list[int]] = []
        for _, each in self.spans(everything):
            blocks.append([])
            for number in each:
                if blocks[-1] and sum(self.widths[i] for i in [*blocks[-1], number]) > room:
                    blocks.append([])
                blocks[-1].append(number)
        return blocks

    def headings(self, heading: str, block: Sequence[int]) -> list[str]:
        """The lines above the rows: splits, where there are any, and what the columns are."""
        out = []
        if any(self.heads[i].split for i in block):
            spans = [(split, sum(self.widths[i] for i in each)) for split, each in self.spans(block)]
            over = (to_the_right(f" {name} ".center(size - 2 - GAP, "-"), size) for name, size in spans)
            out.append(f"  {' ' * self.first}{''.join(over)}")
        tall = max(len(self.heads[i].lines) for i in block)
        tops = [("",) * (tall - len(self.heads[i].lines)) + self.heads[i].lines for i in block]
        names = [""] * (tall - 1) + [heading]
        return [*out, *map(partial(self._line, block), names, zip(*tops, strict=True))]

    def row(self, line: _Line, block: Sequence[int]) -> list[str]:
        """The lines of a row: its name, which may take several, and its stacked cells."""
        stacks = [wrapped(printable(line.name), self.first), *(line.cells[i] for i in block)]
        return [self._line(block, name, cells) for name, *cells in zip_longest(*stacks, fillvalue="")]

    def _line(self, block: Sequence[int], name: str, cells: Sequence[str]) -> str:
        body = "".join(to_the_right(cell, self.widths[i]) for i, cell in zip(block, cells, strict=True))
        return f"  {name}{' ' * (self.first - width(name))}{body}".rstrip()
