"""Texts of legends that all renderers share, and names made safe to print."""

import re
import unicodedata
from collections.abc import Sequence

from retarget_bench.analysis.statistics import ALPHA, ENOUGH_CLIPS, LEVEL
from retarget_bench.tables.model import EMPTY, Column, Group, Row, Table

NOT_RANKED = "not ranked"
NO_COLUMN = "no case here has any of the values asked for"
MEANS = (
    "Numbers are means over source clips of the mean over a clip's cases. Ranked methods are compared on "
    "the cases that all of them have a number for. Controls (such as the reference itself, or no motion) "
    "and methods with privileged inputs are not ranked."
)
ARROWS = "↓ less is better, ↑ more is better, →1 best at 1 (ranked by the mean of |log|)."
BEST = f"best of the ranked methods (not marked below {ENOUGH_CLIPS} clips)"
TIED = (
    f"tied: no significant difference from the best (paired sign-flip test over clips at {100 * ALPHA:g} "
    "%, Holm-corrected for all pairs of methods), or one below the tolerance of the value"
)
INTERVALS = (
    f"Intervals are {100 * LEVEL:g} %, over source clips (none below {ENOUGH_CLIPS} clips). They hold for "
    "these characters only. With few clips an end may lie outside the range of the value, such as below 0 "
    "for an error. Overlapping intervals do not mean a tie, since methods are compared case by case."
)
SEEDS = "± is the standard deviation of the mean over the seeds of a stochastic method."
N = "number of cases answered, or answered/asked"
N_PART = "cases of the part; a method that answered fewer has its mean over those"
WINDOWS = "windows in each of the two sets that are compared"
COMMON = "common cases"
SPLITS = {
    "self": "each character performs its own motion",
    "intra": "another character of the same structure performs it",
    "cross": "a character of another structure performs it",
}


def empty_kinds(table: Table) -> list[str]:
    """The kinds of missing values in a table."""
    shown = {cell.text for cell in table.cells if cell.value is None}
    return [kind for kind in EMPTY if kind in shown]


def has_marks(tables: Sequence[Table]) -> bool:
    return any(cell.mark for table in tables for cell in table.cells)


def has_seeds(tables: Sequence[Table]) -> bool:
    return any(cell.spread is not None for table in tables for cell in table.cells)


def common_counts(group: Group) -> list[str]:
    """Number of cases that each column is ranked on; empty where it equals the n of every ranked row."""
    counts = [f"{common.cases}" if common else "" for common in group.common]
    known = {row.n for row in group.ranked}
    alike = len(known) == 1 and set(counts) <= known | {""}
    return counts if any(counts) and not alike else []


def named(row: Row) -> str:
    """A row's name and why it is not ranked."""
    return f"{row.label} ({row.mark})" if row.mark else row.label


def shown_unit(column: Column) -> str:
    """The unit; "" where there is none to show."""
    return column.unit if column.unit != "1" else ""


def meanings(table: Table) -> list[tuple[str, str]]:
    """(label, meaning) of every column, of n and of the kinds of missing values.

    The label of a column has its unit, and is its id where two columns have one label.
    """
    labels = [column.label for column in table.explained]
    found = []
    for column in table.explained:
        unit = shown_unit(column)
        name = column.label if labels.count(column.label) == 1 else column.id
        found.append((name + (f" [{unit}]" if unit else ""), column.meaning))
    kinds = dict.fromkeys(map(counted, table.groups)) or {N: None}
    found += [("n (windows)" if kind == WINDOWS else "n", kind) for kind in kinds]
    return [*found, *((kind, EMPTY[kind]) for kind in empty_kinds(table))]


def notes(table: Table) -> list[str]:
    """Sentences below a table: columns without values, notes, cases without an answer."""
    absent = [sentence for group in table.groups for sentence in group.absent]
    return [*absent, *table.notes, *(problem.sentence for problem in table.problems)]


def counted(group: Group) -> str:
    """Meaning of n in one group."""
    if group.counted == "windows":
        return WINDOWS
    return N_PART if group.subject else N


# ----------------------------------------------------------------------------------------- safe to print
def printable(words: str) -> str:
    """One line; characters that move the cursor, hide or reorder text are written as escapes."""
    shown = (each if each.isprintable() else _escape(each) for each in words)
    return re.sub(r" +", " ", "".join(shown)).strip()


def _escape(each: str) -> str:
    return " " if each.isspace() else each.encode("unicode_escape").decode()


def width(words: str) -> int:
    """Width of a printable text in a terminal, in characters."""
    wide = sum(unicodedata.east_asian_width(each) in "WF" for each in words)
    return len(words) + wide - sum(bool(unicodedata.combining(each)) for each in words)


def wrapped(name: str, most: int) -> list[str]:
    """A name on lines of at most ``most`` places, broken at spaces, after [ and commas, or anywhere."""
    lines = [""]
    for piece in re.findall(r"[^\s\[,]*[\[,]?\s*", name):
        rest = piece
        if lines[-1].strip() and width(lines[-1] + rest.rstrip()) > most:
            lines[-1] = lines[-1].rstrip()
            lines.append("  ")
        while width(lines[-1] + rest.rstrip()) > most:
            cut = next(i for i in range(len(rest), 0, -1) if i == 1 or width(lines[-1] + rest[:i]) <= most)
            lines[-1] += rest[:cut]
            lines.append("  ")
            rest = rest[cut:]
        lines[-1] += rest
    return [line.rstrip() for line in lines if line.strip()] or [""]
