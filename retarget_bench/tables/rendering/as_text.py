"""Tables as aligned text for a width, with intervals and all notes on request."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from retarget_bench.errors import printable
from retarget_bench.tables.model import MARKS, Cell, Column, Group, Row, Table
from retarget_bench.tables.rendering import words
from retarget_bench.tables.rendering.words import filled, to_the_right, width, wrapped

WIDTH = 100
"""Where nothing is said, as in pipes and files."""
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
            return _Line(words.named(row), (*cells, (row.n,)) if group.counts else cells)

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
        bare = [_widest(head, [line.cells[i] for line in rows]) for i, head in enumerate(heads)]
        names = [printable(heading), *(printable(line.name) for line in rows)]
        splits = {head.split for head in heads if head.split}
        first, gap = self._fitting(
            names, sum(bare) + GAP * max(0, len(splits) - 1), len(bare), bool(splits)
        )
        widths = [each + gap for each in bare]
        for i, head in enumerate(heads):
            if head.split and i and heads[i - 1].split != head.split:
                widths[i] += GAP
        out: list[str] = []
        for block in _blocks(heads, widths, self.width - 2 - first):
            out += ["", *self._block(heading, heads, lines, block, first, widths)]
        return out[1:]

    def _fitting(self, names: Sequence[str], taken: int, columns: int, splits: bool) -> tuple[int, int]:
        """The width of names and the space before columns: as much as fits on the page, or as is needed.

        taken: the width of so many columns without these spaces.
        """
        longest = max(map(width, names))
        bare = max(width(name.partition(" (")[0]) for name in names)
        narrow = min(longest, bare if splits else max(bare, NARROWEST_NAME))
        for name, gap in ((longest, 2), (longest, 1), (narrow, 1)):
            if 2 + name + taken + gap * columns <= self.width:
                return name, gap
        return min(longest, WIDEST_NAME), 2

    def _block(
        self,
        heading: str,
        heads: Sequence[_Head],
        lines: Sequence[_Line],
        block: Sequence[int],
        first: int,
        widths: Sequence[int],
    ) -> list[str]:
        out = []
        if any(heads[i].split for i in block):
            spans = [(split, [widths[i] for i in each]) for split, each in _spans(heads, block)]
            over = [f" {split} ".center(sum(each) - 2 - GAP, "-") for split, each in spans]
            out.append(_joined("", over, first, [sum(each) for _, each in spans]))
        tall = max(len(heads[i].lines) for i in block)
        tops = [[""] * (tall - len(heads[i].lines)) + list(heads[i].lines) for i in block]
        for number, each in enumerate(zip(*tops, strict=True)):
            name = heading if number == tall - 1 else ""
            out.append(_joined(name, each, first, [widths[i] for i in block]))
        for line in lines:
            if line.cells:
                out += _body(line, block, first, widths)
            else:
                out += textwrap.wrap(line.name, self.width, initial_indent="  ", subsequent_indent="     ")
        return out

    # ------------------------------------------------------------------------------------------ legend
    def legend(self, table: Table) -> list[str]:
        """What stands below the table; of each method that lacks answers one line, without notes."""
        lines: list[str] = []
        short = set() if self.notes or table.reading else set(words.problem_lines(table))
        for lead, sentence in words.legend(table, self.notes, self.intervals):
            whole = printable(sentence)
            if sentence in short:
                lines.append(textwrap.shorten(f"{lead}{whole}", self.width, placeholder=" ..."))
            else:
                lines += self.hung(lead, whole)
        return lines

    def hung(self, lead: str, sentence: str) -> list[str]:
        return filled(sentence, self.width, lead, " " * len(lead)) or [lead]


def _widest(head: _Head, cells: Sequence[Sequence[str]]) -> int:
    return max(width(part) for parts in (head.lines, *cells) for part in parts)


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


def _spans(heads: Sequence[_Head], block: Sequence[int]) -> list[tuple[str, list[int]]]:
    """The columns of each split that follow each other."""
    return [(split, list(each)) for split, each in groupby(block, key=lambda i: heads[i].split)]


def _blocks(heads: Sequence[_Head], widths: Sequence[int], room: int) -> list[list[int]]:
    """Numbers of columns that fit beside each other; at least one in each block.

    Columns of several splits stand side by side where all fit, otherwise one split at a time.
    """
    everything = list(range(len(widths)))
    if sum(widths) <= room:
        return [everything]
    blocks: list[list[int]] = []
    for _, each in _spans(heads, everything):
        blocks.append([])
        for number in each:
            if blocks[-1] and sum(widths[i] for i in blocks[-1]) + widths[number] > room:
                blocks.append([])
            blocks[-1].append(number)
    return blocks


def _body(line: _Line, block: Sequence[int], first: int, widths: Sequence[int]) -> list[str]:
    names = wrapped(printable(line.name), first)
    cells = [line.cells[i] for i in block]
    tall = max(len(names), *(len(each) for each in cells))
    rows = zip(*([*each, *[""] * (tall - len(each))] for each in (names, *cells)), strict=True)
    return [_joined(name, row, first, [widths[i] for i in block]) for name, *row in rows]


def _joined(name: str, cells: Sequence[str], first: int, widths: Sequence[int]) -> str:
    body = "".join(map(to_the_right, cells, widths))
    return f"  {name}{' ' * (first - width(name))}{body}".rstrip()
