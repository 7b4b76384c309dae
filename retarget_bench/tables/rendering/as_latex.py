"""Tables as LaTeX with booktabs, for ``\\input`` into a paper, readable by any TeX engine.

What else there is to say about the numbers follows the table as comments.
"""

import unicodedata
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

from retarget_bench import files
from retarget_bench.errors import printable
from retarget_bench.tables.model import Cell, Group, Mark, Table
from retarget_bench.tables.rendering import words

ESCAPES = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\char34{}",
    "'": r"\char39{}",
    "`": r"\char96{}",
    "-": "-{}",
    "–": "--",
    "—": "---",
    "…": r"\ldots{}",
    "↓": r"$\downarrow$",
    "↑": r"$\uparrow$",
    "→": r"$\rightarrow$",
    "±": r"$\pm$",
    "×": r"$\times$",
    "°": r"$^\circ$",
    "²": r"$^2$",
}
MISSING = "--"
LONGEST_NAME = 24
NAME_COLUMN = r"p{0.21\linewidth}"
"""A column of names longer than that, which take several lines."""
MOST_COLUMNS, WITH_INTERVALS = 10, 7
"""Columns that fit across a page."""
ONE_COLUMN = 4
"""Tables with more columns of numbers are as wide as the page."""


def latex(tables: Sequence[Table], intervals: bool = False) -> str:
    """A table environment per group; a group of many columns has several."""
    head = "% needs \\usepackage{booktabs} in the preamble\n"
    most = WITH_INTERVALS if intervals else MOST_COLUMNS
    environments, labels = [], Counter[str]()
    for table in tables:
        for group in table.groups:
            label = files.slug(f"{table.title} {group.split}")
            for first in range(0, max(len(group.columns), 1), most):
                labels[label] += 1
                number = f"-{labels[label]}" if labels[label] > 1 else ""
                part = _part(group, slice(first, first + most))
                environments.append(_environment(table, part, label + number, intervals))
    return head + "\n".join(environments)


def plain(sentence: str) -> str:
    """Text escaped for TeX; characters that pdfTeX's standard fonts lack become code points."""
    return "".join(ESCAPES.get(each) or _letter(each) for each in printable(sentence))


def _letter(each: str) -> str:
    if each.isascii():
        return each
    parts = unicodedata.normalize("NFD", each)
    accented = len(parts) > 1 and parts[0].isascii() and each <= "ÿ"
    return each if accented else f"[U+{ord(each):04X}]"


def _part(group: Group, some: slice) -> Group:
    """A group with some of its columns."""
    ranked, unranked = (
        tuple(replace(row, cells=row.cells[some]) for row in rows)
        for rows in (group.ranked, group.unranked)
    )
    return replace(group, columns=group.columns[some], ranked=ranked, unranked=unranked)


SIGNS: dict[Mark, str] = {"": "", "best": "Bold:", "tied": "underlined:"}


def _environment(table: Table, group: Group, label: str, intervals: bool) -> str:
    name = "table*" if len(group.columns) > ONE_COLUMN else "table"
    return "\n".join(
        [
            rf"\begin{{{name}}}",
            r"\centering\small\setlength{\tabcolsep}{4pt}",
            rf"\caption{{{_caption(table, group, intervals)}}}",
            rf"\label{{tab:{label}}}",
            r"\vspace{4pt}",
            *(_tabular(group, intervals) if group.columns else [plain(words.NO_COLUMN)]),
            rf"\end{{{name}}}",
            *(f"% {printable(line)}" for line in group.below),
            *(
                f"% {lead.lstrip()}{printable(line)}"
                for lead, line in words.legend(table, notes=True, signs=SIGNS)
            ),
            "",
        ]
    )


def _caption(table: Table, group: Group, intervals: bool) -> str:
    """The data and how to read the table: two lines on a page."""
    cells = [cell for row in group.rows for cell in row.cells]
    marks = {cell.mark for cell in cells}
    parts = [
        (r"\textbf{Bold}: best", "best" in marks),
        (r"\underline{underlined}: not significantly different from it", "tied" in marks),
        (r"small: 95\% intervals over clips", intervals and any(cell.interval for cell in cells)),
        (plain("±: standard deviation over seeds"), any(cell.spread is not None for cell in cells)),
    ]
    reading = "; ".join(each for each, there in parts if there)
    shown = f"{plain(table.title)}; {plain(group.title)}."
    return shown + (f" {reading[0].upper()}{reading[1:]}." if reading else "")


# --------------------------------------------------------------------------------------------- tabular
def _tabular(group: Group, intervals: bool) -> list[str]:
    """The rows of a group, with their n where that differs."""
    counted = len({row.n for row in group.rows}) > 1
    longest = max((len(words.row_name(row)) for row in group.rows), default=0)
    width = len(group.columns) + counted
    first = "l" if longest <= LONGEST_NAME else NAME_COLUMN
    head_texts = (
        f"{column.label} {column.arrow}".strip() + (f" ({column.mark})" if column.mark else "")
        for column in group.columns
    )
    heads = [_stack(plain(name).split(" "), "b") for name in head_texts]
    units = [_small(plain(words.shown_unit(column))) for column in group.columns]
    out = [rf"\begin{{tabular}}{{@{{}}{first}{'r' * width}@{{}}}}", r"\toprule", *_splits(group, counted)]
    out.append(_joined([plain(group.heading), *heads, *["$n$"] * counted]))
    if any(units):
        out.append(_joined(["", *units, *[""] * counted]))
    for heading, rows in group.blocks:
        out.append(r"\midrule")
        if heading:
            out.append(rf"\multicolumn{{{width + 1}}}{{@{{}}l}}{{\emph{{{plain(heading)}}}}} \\")
        for row in rows:
            cells = [_cell(each, intervals) for each in row.cells]
            out.append(_joined([_name(words.row_name(row)), *cells, *[plain(row.n)] * counted]))
    return [*out, r"\bottomrule", r"\end{tabular}"]


def _splits(group: Group, counted: bool) -> list[str]:
    """A line with the names of the splits over their columns, and rules below them."""
    if not any(column.split for column in group.columns):
        return []
    names, rules, start = [""], [], 2
    for split, columns in groupby(group.columns, key=lambda column: column.split):
        width = len(list(columns))
        names.append(rf"\multicolumn{{{width}}}{{c}}{{{plain(split)}}}")
        rules.append(rf"\cmidrule(lr){{{start}-{start + width - 1}}}")
        start += width
    return [_joined([*names, *[""] * counted]), "".join(rules)]


def _joined(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def _stack(lines: Sequence[str], place: str) -> str:
    """Lines below each other; ``{}`` keeps them from being read as options of a break."""
    return rf"\begin{{tabular}}[{place}]{{@{{}}r@{{}}}}{{}}" + r" \\ {}".join(lines) + r"\end{tabular}"


def _name(label: str) -> str:
    """A name that may be broken after brackets, commas and underscores."""
    shown = plain(label)
    for each in ("[", ",", r"\_"):
        shown = shown.replace(each, rf"{each}\allowbreak{{}}")
    return rf"\raggedright {shown}" if len(label) > LONGEST_NAME else f"{{}}{shown}"


def _cell(cell: Cell, intervals: bool) -> str:
    """Number and mark; below them the interval, if asked for, and the spread over seeds."""
    if cell.value is None:
        return MISSING
    first = f"${cell.text}$"
    if cell.mark == "best":
        first = rf"\textbf{{{cell.text.replace('-', '$-$')}}}"
    if cell.mark == "tied":
        first = rf"\underline{{{first}}}"
    below = [cell.between if intervals else "", f"±{cell.between_seeds}" if cell.spread is not None else ""]
    lines = [first, *(_small(plain(each)) for each in below if each)]
    return first if len(lines) == 1 else _stack(lines, "t")


def _small(what: str) -> str:
    return rf"{{\scriptsize {what}}}" if what else ""
