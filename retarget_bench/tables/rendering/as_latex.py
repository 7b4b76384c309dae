"""Tables as LaTeX with booktabs, for ``\\input`` into a paper, readable by any TeX engine.

Splits stand beside each other where they fit. What else there is to say about the numbers follows the table
as comments.
"""

import unicodedata
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from retarget_bench import files
from retarget_bench.errors import printable
from retarget_bench.tables.model import CONTROL, CONTROLS, NOT_RANKED, Cell, Column, Group, Row, Table
from retarget_bench.tables.names import method_title
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
"""Of names longer than that, which then take several lines."""
MOST_COLUMNS, WITH_INTERVALS = 10, 7
"""Splits stand beside each other up to this many columns, which fit across a page."""
ONE_COLUMN = 4
"""Tables with more columns of numbers are as wide as the page."""


def latex(tables: Sequence[Table], intervals: bool = False) -> str:
    """A table environment per group. Splits with few columns share one; a group with many has several."""
    head = "% needs \\usepackage{booktabs} in the preamble\n"
    most = WITH_INTERVALS if intervals else MOST_COLUMNS
    made, labels = [], Counter[str]()
    for table, groups in [(each, groups) for each in tables for groups in _beside(each, most)]:
        label = files.slug(f"{table.title} {' '.join(group.split for group in groups)}")
        labels[label] += 1
        number = f"-{labels[label]}" if labels[label] > 1 else ""
        made.append(_environment(table, groups, label + number, intervals))
    return head + "\n".join(made)


def plain(sentence: str) -> str:
    """Text escaped for TeX; characters that pdfTeX's standard fonts lack become code points."""
    return "".join(ESCAPES.get(each) or _letter(each) for each in printable(sentence))


def _letter(each: str) -> str:
    if each.isascii():
        return each
    parts = unicodedata.normalize("NFD", each)
    accented = len(parts) > 1 and parts[0].isascii() and each <= "ÿ"
    return each if accented else f"[U+{ord(each):04X}]"


def _beside(table: Table, most: int) -> list[list[Group]]:
    """The groups of each environment: different splits by methods, of so many columns at most."""
    made: list[list[Group]] = []
    for group in (part for whole in table.groups for part in _parts(whole, most)):
        last = made[-1] if made else []
        fits = sum(len(each.columns) for each in (*last, group)) <= most
        splits = {each.split for each in last}
        alone = any(each.subject or not each.split or not each.columns for each in (*last, group))
        if last and fits and not alone and group.split not in splits:
            last.append(group)
        else:
            made.append([group])
    return made


def _parts(whole: Group, most: int) -> list[Group]:
    """A group by so many columns at a time."""

    def rows(of: Sequence[Row], first: int) -> tuple[Row, ...]:
        # rows are told by their labels here, and n says who answered fewer cases
        return tuple(replace(row, cells=row.cells[first : first + most]) for row in of if not row.beside)

    return [
        replace(
            whole,
            columns=whole.columns[first : first + most],
            ranked=rows(whole.ranked, first),
            unranked=rows(whole.unranked, first),
        )
        for first in range(0, max(len(whole.columns), 1), most)
    ]


def _environment(table: Table, groups: Sequence[Group], label: str, intervals: bool) -> str:
    columns = sum(len(group.columns) for group in groups)
    name = "table*" if columns > ONE_COLUMN else "table"
    body = _tabular(groups, intervals) if columns else [plain(words.NO_COLUMN)]
    lines = [
        rf"\begin{{{name}}}",
        r"\centering\small\setlength{\tabcolsep}{4pt}",
        rf"\caption{{{_caption(table, groups, intervals)}}}",
        rf"\label{{tab:{label}}}",
        r"\vspace{4pt}",
        *body,
        rf"\end{{{name}}}",
        *(f"% {printable(line)}" for line in _remarks(table, groups)),
    ]
    return "\n".join(lines) + "\n"


def _caption(table: Table, groups: Sequence[Group], intervals: bool) -> str:
    """The data and how to read the table: two lines on a page."""
    cells = [cell for group in groups for row in group.rows for cell in row.cells]
    shown = groups[0].title
    if len(groups) > 1:
        shown = f"{groups[0].counted}: " + ", ".join(f"{_most(group)} {group.split}" for group in groups)
    marks = {cell.mark for cell in cells}
    sets = any(words.is_fid(column) for group in groups for column in group.columns)
    fid = " (FID: intervals meet)" if sets else ""
    told = [
        (r"\textbf{Bold}: best", "best" in marks),
        (rf"\underline{{underlined}}: not significantly different from it{fid}", "tied" in marks),
        ("small: 95\\% intervals over clips", intervals and any(cell.interval for cell in cells)),
        (plain("±: standard deviation over seeds"), any(cell.spread is not None for cell in cells)),
        (
            r"\emph{italic}: not ranked in this split",
            any(row.label in _upper(groups) for group in groups for row in group.unranked),
        ),
        (
            f"below the line: {CONTROLS if _only_controls(groups) else NOT_RANKED}",
            any(_lower(groups)) and any(_upper(groups)),
        ),
    ]
    reading = "; ".join(each for each, there in told if there)
    return f"{plain(table.title)}; {plain(shown)}." + (
        f" {reading[0].upper()}{reading[1:]}." if reading else ""
    )


def _most(group: Group) -> str:
    """The greatest number of cases of a row, as in ``43`` or ``43/47``."""
    return max((row.n.split("/")[0] for row in group.rows), key=lambda n: int(n) if n.isdigit() else 0)


# --------------------------------------------------------------------------------------------- tabular
def _tabular(groups: Sequence[Group], intervals: bool) -> list[str]:
    """The rows of all groups by their labels; with their n where that differs."""
    counted = [_differs(group) for group in groups]
    widths = [len(group.columns) + n for group, n in zip(groups, counted, strict=True)]
    upper, lower = _upper(groups), _lower(groups)
    longest = max((len(_title(groups, label)) for label in (*upper, *lower)), default=0)
    first = "l" if longest <= LONGEST_NAME else NAME_COLUMN
    out = [rf"\begin{{tabular}}{{@{{}}{first}{'r' * sum(widths)}@{{}}}}", r"\toprule"]
    if len(groups) > 1:
        out += _splits(groups, widths)
    heads, units = [], []
    for group, n in zip(groups, counted, strict=True):
        names = [_column(group, column) for column in group.columns]
        heads += [_stack(plain(name).split(" "), "b") if name else "" for name in names] + ["$n$"] * n
        units += [_small(plain(words.shown_unit(column))) for column in group.columns] + [""] * n
    out.append(_joined([plain(groups[0].heading), *heads]))
    if any(units):
        out.append(_joined(["", *units]))
    for number, labels in enumerate((upper, lower)):
        if labels and (not number or upper):
            out.append(r"\midrule")
        out += [_line(groups, label, counted, intervals) for label in labels]
    return [*out, r"\bottomrule", r"\end{tabular}"]


def _splits(groups: Sequence[Group], widths: Sequence[int]) -> list[str]:
    """A line with the names of the splits over their columns, and rules below them."""
    names = [
        rf"\multicolumn{{{width}}}{{c}}{{{plain(g.split)}}}"
        for g, width in zip(groups, widths, strict=True)
    ]
    rules, start = [], 2
    for width in widths:
        rules.append(rf"\cmidrule(lr){{{start}-{start + width - 1}}}")
        start += width
    return [_joined(["", *names]), "".join(rules)]


def _upper(groups: Sequence[Group]) -> list[str]:
    """Labels of the rows that are ranked in any group, in the order of the last that has them."""
    return list(dict.fromkeys(row.label for group in reversed(groups) for row in group.ranked))


def _lower(groups: Sequence[Group]) -> list[str]:
    upper = _upper(groups)
    return [
        label
        for label in dict.fromkeys(row.label for group in reversed(groups) for row in group.unranked)
        if label not in upper
    ]


def _only_controls(groups: Sequence[Group]) -> bool:
    """True where the line above the rows that are not ranked needs to say no more than that."""
    upper = _upper(groups)
    marks = {row.mark for group in groups for row in group.unranked if row.label not in upper}
    return bool(upper) and marks == {CONTROL}


def _differs(group: Group) -> bool:
    return len({row.n for row in group.rows}) > 1


def _column(group: Group, column: Column) -> str:
    name = method_title(column.label) if group.subject else column.label
    return f"{name} {column.arrow}".strip() + (f" ({column.mark})" if column.mark else "")


def _joined(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def _stack(lines: Sequence[str], place: str) -> str:
    """Lines below each other; ``{}`` keeps them from being read as options of a break."""
    return rf"\begin{{tabular}}[{place}]{{@{{}}r@{{}}}}{{}}" + r" \\ {}".join(lines) + r"\end{tabular}"


def _line(groups: Sequence[Group], label: str, counted: Sequence[bool], intervals: bool) -> str:
    cells = []
    for group, n in zip(groups, counted, strict=True):
        row = next((row for row in group.rows if row.label == label), None)
        apart = row is not None and row in group.unranked and label in _upper(groups)
        shown = row.cells if row else (Cell(MISSING),) * len(group.columns)
        cells += [
            rf"\emph{{{_cell(each, intervals)}}}" if apart else _cell(each, intervals) for each in shown
        ]
        cells += [plain(row.n) if row else MISSING] * n
    return _joined([_name(_title(groups, label)), *cells])


def _title(groups: Sequence[Group], label: str) -> str:
    """The name of a row as people write it, and why it is ranked nowhere."""
    row = next(row for group in groups for row in group.rows if row.label == label)
    title = method_title(label) if groups[0].heading == "method" else label
    told = not row.mark or label in _upper(groups) or _only_controls(groups)
    return title if told else f"{title} ({row.mark})"


def _name(title: str) -> str:
    """A name that may be broken after brackets, commas and underscores."""
    shown = plain(title)
    for each in ("[", ",", r"\_"):
        shown = shown.replace(each, rf"{each}\allowbreak{{}}")
    return rf"\raggedright {shown}" if len(title) > LONGEST_NAME else f"{{}}{shown}"


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


def _remarks(table: Table, groups: Sequence[Group]) -> list[str]:
    """All else that a reader of the numbers should know, for comments."""
    labels = {column.label: column.meaning for group in groups for column in group.columns}
    out = [words.means(table), words.ARROWS]
    out += [f"{label}: {meaning}." for label, meaning in labels.items()]
    out += [f"n: {words.counted(groups[0])}."] if any(map(_differs, groups)) else []
    cells = [cell for group in groups for row in group.rows for cell in row.cells]
    out += [*words.rare(cells), *words.below(groups)]
    out += dict.fromkeys(sentence for group in groups for sentence in group.absent)
    used = sorted({cell.footnote for cell in cells if cell.footnote})
    out += [f"missing or not ranked: {table.footnotes[number - 1]}." for number in used]
    splits = {group.split for group in groups}
    return [
        *out,
        *table.hints,
        *table.notes,
        *(each.sentence for each in table.problems if each.split in splits),
    ]
