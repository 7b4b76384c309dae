"""The page for a paper's appendix, drawn: a table, and below it the items in two columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate, groupby, pairwise, takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from retarget_bench.errors import printable
from retarget_bench.figures.plotting import canvas
from retarget_bench.files import atomic
from retarget_bench.report.appendix import Appendix
from retarget_bench.tables.model import Cell, Column, Group, Row, count
from retarget_bench.tables.rendering import words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HEIGHT, MARGIN = 612.0, 792.0, 40.0
"""Points: US letter, on which NeurIPS, CVPR and SIGGRAPH are set."""
ACROSS, GAP, GUTTER = WIDTH - 2 * MARGIN, 7.0, 16.0
"""Points: of text, before a column of the table, and between columns of text."""
TITLE, TABLE, SMALL, TEXT = 12.0, 8.0, 6.4, 6.9
"""Sizes of letters, in points."""
LETTERS, LINES = 400, 14
"""More letters than there are in a line, and lines below the table."""
LEADING = 1.17
"""Height of a line over the size of its letters."""
WIDEST_NAME, WIDEST_WORD, SPREAD = 120.0, 50.0, 14.0
"""Points: of a name on one line, of a word above a column, and how far columns are spread."""
FONTS = ["STIXGeneral", "DejaVu Sans"]
"""That of papers, and what has the letters that it lacks."""
TOGETHER = re.compile(r" (?=%)|(?<= -[a-z]) |(?<= --seed) |(?<= --task) ")
"""Spaces that no line ends at: before a percent sign, and behind an option of a command."""
BREAKS, CUT = "[,_/+=>;-", "[…]"
"""Signs after which a long name is broken, and the sign of what was cut."""
MORE = (
    f"{CUT}: cut for want of room; bench table --notes, bench info and the headers of the results have all."
)

Text = tuple[float, float, str, float, str, str]
"""Words in a strip: x, baseline below its top, the words, their size and style, and which side x is of."""


@dataclass(frozen=True)
class Strip:
    """A piece of the page as wide as it or a column, of some height.

    rules: from, to, and how far down, from the upper left corner, in points.
    """

    height: float
    texts: tuple[Text, ...] = ()
    rules: tuple[tuple[float, float, float], ...] = ()


def write(path: Path, pages: Sequence[Appendix]) -> None:
    """All pages in one file; the same pages are the same file, byte for byte. Raises FileError."""
    from matplotlib.backends.backend_pdf import PdfPages

    form = canvas.ENDINGS[canvas.ending(path)]
    titles = [f"page {number}: {each.title}" for number, each in enumerate(pages, 1)]
    with canvas.styled(), atomic(path) as temporary, PdfPages(temporary, metadata=form) as file:
        for number, page in enumerate(pages):
            others = "; ".join(titles[:number] + titles[number + 1 :])
            foot = f"Page {number + 1} of {len(pages)}; {others}." if others else ""
            drawn(page, foot).savefig(file, format="pdf")


def drawn(page: Appendix, foot: str) -> Figure:
    """The figure of a page. foot: a sentence at its end."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    top = filled([(page.title, "bold")], TITLE, most=2) + filled([(page.lead, "")], TABLE, most=4)
    below = [line for each in page.below for line in filled([(each, "")], SMALL, most=5)]
    below[LINES:] = filled([(CUT, "")], SMALL) if below[LINES:] else []
    end = filled([(f"{foot} {MORE}", "italic")], SMALL, gap=TEXT, most=3)
    room = HEIGHT - 2 * MARGIN - _height([*top, *below, *end]) - 2 * TEXT
    room -= 2 * SMALL * LEADING if len(page.groups) > 1 else 0.0  # to say which are left out
    grids = [_table(group) for group in page.groups]
    columns = _columns(page.items, max(room - sum(map(_height, grids)), room / 2))
    room -= max(map(_height, columns))
    rows, left = [line for group in page.groups[:1] for line in _table(group, room)], []
    for group, grid in zip(page.groups[1:], grids[1:], strict=True):
        fits = _height([*rows, *grid]) <= room
        rows += grid if fits else []
        left += [] if fits else [group.title]
    if left:
        below += filled([(f"Left out for want of room: {'; '.join(left)}.", "")], SMALL, most=2)
    figure = Figure(figsize=(WIDTH / 72, HEIGHT / 72))
    FigureCanvasAgg(figure)
    y = _draw(figure, [*top, Strip(TEXT), *rows, *below, Strip(TEXT)], 0.0, 0.0)
    y = max(_draw(figure, lines, k * (ACROSS + GUTTER) / 2, y) for k, lines in enumerate(columns))
    lines = (*top, *rows, *below, *columns[0], *columns[1])
    if not any(CUT in text[2] for line in lines for text in line.texts):
        end = filled([(foot, "italic")], SMALL, gap=TEXT, most=3)
    _draw(figure, end, 0.0, y)
    return figure


def _draw(figure: Figure, strips: Sequence[Strip], x: float, y: float) -> float:
    """Draw strips below each other, from a place within the margins; returns where they end."""
    from matplotlib.lines import Line2D

    for strip in strips:
        left, top = MARGIN + x, HEIGHT - MARGIN - y
        for across, down, text, size, style, side in strip.texts:
            at = (left + across) / WIDTH, (top - down) / HEIGHT
            figure.text(*at, text, fontproperties=_font(size, style), ha=side, va="baseline")
        for start, stop, down in strip.rules:
            ends, level = [(left + start) / WIDTH, (left + stop) / WIDTH], (top - down) / HEIGHT
            figure.add_artist(Line2D(ends, [level, level], color="black", linewidth=0.5))
        y += strip.height
    return y


def _height(strips: Sequence[Strip]) -> float:
    return sum(strip.height for strip in strips)


# ------------------------------------------------------------------------------------------------- text
def _font(size: float, style: str) -> Any:
    from matplotlib.font_manager import FontProperties

    slant: Literal["italic", "normal"] = "italic" if style == "italic" else "normal"
    weight = "bold" if style == "bold" else "normal"
    return FontProperties(family=FONTS, style=slant, weight=weight, size=size)


@lru_cache(maxsize=50_000)
def _width(text: str, size: float, style: str = "") -> float:
    from matplotlib.textpath import text_to_path

    return float(text_to_path.get_text_width_height_descent(text, _font(size, style), False)[0])


def filled(
    runs: Sequence[tuple[str, str]], size: float, across: float = ACROSS, gap: float = 0.0, most: int = 0
) -> list[Strip]:
    """Words on lines of some width; of more than ``most`` lines (0: any number) the last ends with ``CUT``.

    runs: texts and their styles. gap: above the first line.
    """
    space, end = _width("n n", size) - _width("nn", size), 0.0
    lines: list[list[tuple[str, str]]] = [[]]
    for text, style in runs:
        some = TOGETHER.sub(words.NO_BREAK, printable(text)[: LETTERS * most or None])
        for word in filter(None, some.split(" ")):
            for part in _parts(word, size, style, across):
                wide = _width(part, size, style)
                if lines[-1] and end + space + wide > across:
                    lines.append([])
                end = end + space + wide if lines[-1] else wide
                lines[-1].append((part, style))
    if most and len(lines) > most:
        free = across - _width(CUT, size) - space
        last = [word for word, _ in lines[most - 1]]
        while len(last) > 1 and _width(" ".join(last), size, "bold") > free:
            last.pop()
        style = lines[most - 1][0][1]
        lines[most - 1 :] = [[*((_parts(word, size, style, free)[0], style) for word in last), (CUT, "")]]
    strips = []
    for number, line in enumerate(lines if runs and lines[0] else ()):
        x, above, texts = 0.0, 0.0 if number else gap, []
        for style, each in groupby(line, key=lambda word: word[1]):
            text = " ".join(word for word, _ in each)
            texts.append((x, above + size, text.replace(words.NO_BREAK, " "), size, style, "left"))
            x += _width(text, size, style) + space
        strips.append(Strip(above + size * LEADING, tuple(texts)))
    return strips


@lru_cache(maxsize=10_000)
def _parts(word: str, size: float, style: str, across: float) -> tuple[str, ...]:
    """A word, in parts where it is wider than a line."""
    parts = []
    while len(word) > 1 and _width(word, size, style) > across:
        widths = (_width(word[:n], size, style) for n in range(2, len(word)))
        fits = 1 + sum(1 for _ in takewhile(across.__ge__, widths))
        after_sign = max(word.rfind(sign, 0, fits) + 1 for sign in BREAKS)
        at = after_sign if after_sign > fits / 3 else fits
        parts.append(word[:at])
        word = word[at:]
    return (*parts, word)


def _columns(items: Sequence[tuple[str, str]], room: float) -> tuple[list[Strip], list[Strip]]:
    """The items in two columns of one height, each of as many lines as there is room for."""
    across = (ACROSS - GUTTER) / 2
    columns: tuple[list[Strip], list[Strip]] = [], []
    for most in range(40, 1, -1):
        texts = ([(f"{heading}.", "bold"), (text, "")] for heading, text in items)
        strips = [line for each in texts for line in filled(each, TEXT, across, 2.5, most)]
        ends = [*accumulate(strip.height for strip in strips)]
        half = next((n for n, end in enumerate(ends, 1) if end >= ends[-1] / 2), 0)
        columns = strips[:half], strips[half:]
        if max(map(_height, columns)) <= room:
            break
    return columns


# ------------------------------------------------------------------------------------------------ table
def _table(group: Group, room: float = 1e9) -> list[Strip]:
    """The lines of a group, with the rows that there is room for, and a sentence on what is left out."""
    whole = _transposed(group) if group.subject else group
    shown = _fitting(whole)
    lost = [f"{each.split} {each.label}".strip() for each in whole.columns[len(shown.columns) :]]
    head, rows = _head(shown), _rows(shown)
    for kept in range(len(rows), -1, -1):
        names = [name for name, _ in rows[kept:] if name]
        left = [f"columns {', '.join(lost)}"] if lost else []
        left += [f"{count(len(names), 'more row')}: {', '.join(names)}"] if names else []
        note = (
            filled([(f"Left out for want of room: {'; '.join(left)}.", "")], SMALL, most=2) if left else []
        )
        lines = [*head, *(strip for _, strip in rows[:kept]), _rule(_edges(shown)[-1]), *note]
        if _height(lines) <= room and (not kept or rows[kept - 1][0]):  # a heading is not the last
            break
    return lines


def _transposed(group: Group) -> Group:
    """A breakdown with a row for each method."""
    columns = tuple(Column(row.label, f"{row.label} (n {row.n})", "1", "none", "") for row in group.rows)
    cells = zip(*(row.cells for row in group.rows), strict=True)
    rows = (Row(c.label, c.mark, each, "") for c, each in zip(group.columns, cells, strict=True))
    return replace(group, columns=columns, ranked=tuple(rows), unranked=(), common=(), heading="method")


def _fitting(group: Group) -> Group:
    """With as many of the first columns as there is room for, and at least one."""
    for n in range(len(group.columns), 0, -1):
        ranked, others = (
            tuple(replace(row, cells=row.cells[:n]) for row in rows)
            for rows in (group.ranked, group.unranked)
        )
        part = replace(group, columns=group.columns[:n], ranked=ranked, unranked=others)
        if n == 1 or _edges(part, 0.0)[-1] <= ACROSS:
            return part
    return group


def _edges(group: Group, spread: float = SPREAD) -> list[float]:
    """Where the names and every column end; columns are at most ``spread`` farther apart than ``GAP``."""
    names = (_width(printable(words.row_name(row)), TABLE) for row in group.rows)
    wide = [min(max(names, default=0.0), WIDEST_NAME) + 2]
    for k, column in enumerate(group.columns):
        heads = (
            min(_width(each, SMALL, "bold"), WIDEST_WORD)
            for line, _ in _label(column)
            for each in line.split(" ")
        )
        wide.append(
            GAP + max([*heads, *(_width(*part) for row in group.rows for part in _stack(row.cells[k]))])
        )
    free = min(spread, max(0.0, ACROSS - sum(wide)) / max(1, len(group.columns)))
    return list(accumulate([wide[0], *(each + free for each in wide[1:])]))


def _label(column: Column) -> list[tuple[str, str]]:
    """The lines above a column, with their style: label and arrow, unit, and why it is not ranked."""
    arrow = f"{words.NO_BREAK}{column.arrow}" if column.arrow else ""
    lines = ((f"{column.label}{arrow}", "bold"), (words.shown_unit(column), ""), (column.mark, "italic"))
    return [(printable(text).replace(" %", f"{words.NO_BREAK}%"), style) for text, style in lines if text]


def _stack(cell: Cell) -> list[tuple[str, float, str]]:
    """The words of a cell below each other, with their size and style."""
    footnote = f" [{cell.footnote}]" if cell.footnote else ""
    spread = f"±{cell.between_seeds}" if cell.spread is not None else ""
    first = (f"{cell.text}{footnote}", TABLE, "bold" if cell.mark == "best" else "")
    return [first, *((each, SMALL, "") for each in (cell.between, spread) if each)]


def _rule(end: float) -> Strip:
    return Strip(3.0, (), ((0.0, end, 1.5),))


def _head(group: Group) -> list[Strip]:
    """The title, splits over their columns, and what columns are."""
    edges = _edges(group)
    strips = [*filled([(group.title, "")], SMALL, gap=3, most=2), _rule(edges[-1])]
    over: list[Text] = []
    rules = []
    for split, each in groupby(enumerate(group.columns), key=lambda column: column[1].split):
        at = [k for k, _ in each]
        start, end = edges[at[0]] + GAP, edges[at[-1] + 1]
        for line in filled([(split, "bold")], TABLE, end - start, most=1):
            over += [(start + text[0], *text[1:]) for text in line.texts]
            rules.append((start, end, TABLE * LEADING + 1))
    strips += [Strip(TABLE * LEADING + 3, tuple(over), tuple(rules))] if over else []
    heads = [
        [line for each in _label(column) for line in filled([each], SMALL, end - start - GAP, most=5)]
        for column, (start, end) in zip(group.columns, pairwise(edges), strict=True)
    ]
    tall = max(map(len, heads), default=1) * SMALL * LEADING
    texts = [(0.0, tall - SMALL * (LEADING - 1), group.heading, SMALL, "bold", "left")]
    for head, edge in zip(heads, edges[1:], strict=True):
        for k, line in enumerate(head):
            y = tall - (len(head) - k) * line.height + SMALL
            texts += [(edge, y, text[2], SMALL, text[4], "right") for text in line.texts]
    return [*strips, Strip(tall, tuple(texts)), _rule(edges[-1])]


def _rows(group: Group) -> list[tuple[str, Strip]]:
    """The name and the strip of every row, and of headings between them, whose name is ""."""
    edges = _edges(group)
    rows: list[tuple[str, Strip]] = []
    for heading, block in group.blocks:
        text = ((0.0, 1.1 * SMALL, heading, SMALL, "italic", "left"),)
        rows += [("", Strip(1.4 * SMALL, text))] if heading else []
        rows += [(row.label, _row(row, edges)) for row in block]
    return rows


def _row(row: Row, edges: Sequence[float]) -> Strip:
    """The name, which may take several lines, and the stacked cells of a row."""
    texts: list[Text] = []
    rules, tall = [], 0.0
    for line in filled([(words.row_name(row), "")], TABLE, edges[0], most=3):
        texts += [(0.0, tall + TABLE, text[2], TABLE, text[4], "left") for text in line.texts]
        tall += line.height
    for cell, edge in zip(row.cells, edges[1:], strict=True):
        y = 0.0
        for text, size, style in _stack(cell):
            texts.append((edge, y + size, text, size, style, "right"))
            y += size * LEADING
        tall = max(tall, y)
        wide = _width(_stack(cell)[0][0], TABLE)
        rules += [(edge - wide, edge, TABLE + 1.2)] if cell.mark == "tied" else []
    return Strip(tall + 1.0, tuple(texts), tuple(rules))
