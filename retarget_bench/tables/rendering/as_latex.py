"""Tables as LaTeX with booktabs, for ``\\input`` into a paper, readable by any TeX engine."""

import unicodedata
from collections.abc import Sequence

from retarget_bench.tables.model import EMPTY, Cell, Column, Group, Row, Table
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
TIED = r"\textsuperscript{=}"
LONGEST_NAME = 24
NAME_COLUMN = r"p{0.21\linewidth}"
"""Of names longer than that, which then take several lines."""


def latex(tables: Sequence[Table]) -> str:
    """A table environment per group; intervals below the numbers."""
    head = "% needs \\usepackage{booktabs} in the preamble\n"
    return head + "\n".join(_environment(table, group) for table in tables for group in table.groups)


def plain(sentence: str) -> str:
    """Text escaped for TeX; characters that pdfTeX's standard fonts lack become code points."""
    return "".join(ESCAPES.get(each) or _letter(each) for each in words.printable(sentence))


def _letter(each: str) -> str:
    if each.isascii():
        return each
    parts = unicodedata.normalize("NFD", each)
    accented = len(parts) > 1 and parts[0].isascii() and each <= "ÿ"
    return each if accented else f"[U+{ord(each):04X}]"


def _environment(table: Table, group: Group) -> str:
    body = _tabular(group) if group.columns else [plain(words.NO_COLUMN)]
    lines = [
        r"\begin{table}",
        r"\centering\small\setlength{\tabcolsep}{3pt}",
        rf"\caption{{{plain(table.title)}. {plain(group.title)}.}}",
        *body,
        rf"\par\smallskip\parbox{{\linewidth}}{{\footnotesize {' '.join(_legend(table, group))}}}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def _tabular(group: Group) -> list[str]:
    heads = [_stack(plain(_heading(column)).split(" "), "b") for column in group.columns]
    units = [_small(plain(words.shown_unit(column))) for column in group.columns]
    whole = len(group.columns) + 2
    longest = max(len(words.named(row)) for row in group.rows)
    first = "l" if longest <= LONGEST_NAME else NAME_COLUMN
    out = [rf"\begin{{tabular}}{{{first}{'r' * (whole - 1)}}}", r"\toprule"]
    out.append(_joined([plain(group.heading), *heads, "$n$"]))
    if any(units):
        out.append(_joined(["", *units, ""]))
    out.append(r"\midrule")
    out += map(_line, group.ranked)
    if counts := words.common_counts(group):
        out.append(_joined([rf"\emph{{{words.COMMON}}}", *counts, ""]))
    if group.unranked:
        out.append(r"\midrule")
        out.append(_joined([rf"\multicolumn{{{whole}}}{{l}}{{\emph{{{words.NOT_RANKED}}}}}"]))
    out += map(_line, group.unranked)
    return [*out, r"\bottomrule", r"\end{tabular}"]


def _heading(column: Column) -> str:
    return f"{column.label} {column.arrow}".strip() + (f" ({column.mark})" if column.mark else "")


def _joined(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def _stack(lines: Sequence[str], place: str) -> str:
    """Lines below each other; ``{}`` keeps them from being read as options of a break."""
    return rf"\begin{{tabular}}[{place}]{{@{{}}r@{{}}}}{{}}" + r" \\ {}".join(lines) + r"\end{tabular}"


def _line(row: Row) -> str:
    return _joined([_name(row), *(_cell(cell) for cell in row.cells), plain(row.n)])


def _name(row: Row) -> str:
    """A name that may be broken after brackets, commas and underscores."""
    shown = plain(words.named(row))
    for each in ("[", ",", r"\_"):
        shown = shown.replace(each, rf"{each}\allowbreak{{}}")
    return rf"\raggedright {shown}" if len(words.named(row)) > LONGEST_NAME else f"{{}}{shown}"


def _cell(cell: Cell) -> str:
    """Number, mark and footnote; below them the interval and the spread over seeds."""
    number = plain(cell.text) if cell.value is None else f"${cell.text}$"
    if cell.mark == "best":
        number = rf"\textbf{{{cell.text.replace('-', '$-$')}}}"
    tied = TIED if cell.mark == "tied" else ""
    first = number + tied + (rf" \textsuperscript{{[{cell.footnote}]}}" if cell.footnote else "")
    below = [cell.between, f"±{cell.between_seeds}" if cell.spread is not None else ""]
    lines = [first, *(_small(plain(each)) for each in below if each)]
    return first if len(lines) == 1 else _stack(lines, "t")


def _small(what: str) -> str:
    return rf"{{\scriptsize {what}}}" if what else ""


def _legend(table: Table, group: Group) -> list[str]:
    """Legend of a group: columns, marks, intervals, missing values, footnotes, notes."""
    cells = [cell for row in group.rows for cell in row.cells]
    out = [plain(table.reading or words.MEANS), plain(words.ARROWS)]
    if any(cell.mark for cell in cells):
        out.append(rf"\textbf{{Bold}}: {plain(words.BEST)}; {TIED} {plain(words.TIED)}.")
    if any(cell.interval for cell in cells):
        out.append(plain(f"Small: {words.INTERVALS}"))
    if any(cell.spread is not None for cell in cells):
        out.append(plain(words.SEEDS))
    explained = table.subjects or group.columns
    meanings = [(column.label, column.meaning) for column in explained]
    meanings.append(("n", words.counted(group)))
    shown = {cell.text for cell in cells if cell.value is None}
    meanings += [(kind, EMPTY[kind]) for kind in EMPTY if kind in shown]
    out += [rf"\emph{{{plain(label)}}}: {plain(meaning)}." for label, meaning in meanings]
    used = sorted({cell.footnote for cell in cells if cell.footnote})
    out += [plain(f"[{number}] {table.footnotes[number - 1]}.") for number in used]
    problems = (each.sentence for each in table.problems if each.split == group.split)
    notes = [*group.absent, *table.notes, *problems]
    return out + [plain(f"{note.rstrip('.')}.") for note in notes]
