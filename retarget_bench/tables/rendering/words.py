"""Sentences that all renderers share, and names made safe to print."""

import re
import textwrap
import unicodedata
from collections.abc import Mapping, Sequence

from retarget_bench.analysis.statistics import ALPHA, CLIPS_FOR_RARE, ENOUGH_CLIPS, LEVEL, unseen
from retarget_bench.tables.cells import FPS
from retarget_bench.tables.model import (
    CONTROL,
    EMPTY,
    MARKS,
    Column,
    Group,
    Mark,
    Problem,
    Row,
    Table,
    count,
)
from retarget_bench.tables.model import NOT_RANKED as NOT_RANKED

NO_COLUMN = "no case here has any of the values asked for"
MEANS = (
    "Numbers are means over source clips of the mean over a clip's cases. A case is one clip for one "
    "target. Ranked methods are compared on the cases that all of them have a number for. Controls (such "
    "as the reference itself, or no motion) and methods with privileged inputs are not ranked."
)
SPEEDS = "Speeds are measured once for a method, on a few cases of one split, and are not ranked."
ARROWS = "↓ less is better, ↑ more is better, →1 best at 1 (ranked by the mean of |log|)."
BEST = "best of the ranked methods, or equal to it within the tolerance of the value"
TIED = (
    f"tied: no significant difference from the best (paired sign flips over clips at {100 * ALPHA:g} %, "
    "adjusted for all pairs of methods)"
)
BRIEF_MARKS = (
    f"{MARKS['best']} best, or equal to it; {MARKS['tied']} no significant difference ({100 * ALPHA:g} %, "
    "over clips); no mark: significantly worse."
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
ENDED = {
    "unsupported": "does not support",
    "invalid": "gave no valid answer to",
    "failed": "failed on",
    "missing": "lacks predictions of",
    "doubted": "gave odd answers to",
}
"""Status of cases without an answer, or with one that is doubted, as a verb."""
NO_BREAK = "\u00a0"
_COMMAND = re.compile(r"\bbench [a-z-]+(?: --?[a-z][a-z-]*(?: [a-z][\w,-]*)?)*")


# --------------------------------------------------------------------------------------- below a table
def legend(
    table: Table, notes: bool, intervals: bool = False, signs: Mapping[Mark, str] = MARKS
) -> list[tuple[str, str]]:
    """(lead, sentence) of all that stands below a table; leads are bullets, numbers of footnotes or "".

    notes: how numbers are made in full, the meaning of columns, and every note; published tables have
    these always. intervals: whether these are shown. signs: of the best and those tied with it.
    """
    notes = notes or bool(table.reading)
    paragraphs = [table.finding, *reading([table], intervals, full=notes, signs=signs)]
    sentences = [problem.sentence for problem in table.problems] if notes else problem_lines(table)
    full = table.notes if notes else ()
    return [
        *(("", each) for each in paragraphs if each),
        *(("  ", f"{name}: {meaning}") for name, meaning in (meanings(table) if notes else ())),
        *((f"[{number}] ", each) for number, each in enumerate(table.footnotes, 1)),
        *(("- ", each) for each in dict.fromkeys([*full, *sentences, *table.hints])),
    ]


def reading(
    tables: Sequence[Table], intervals: bool, *, full: bool = True, signs: Mapping[Mark, str] = MARKS
) -> list[str]:
    """How to read the numbers, marks, intervals and spreads that these tables have.

    full: how numbers are made and compared; otherwise only the marks in brief.
    """
    cells = [cell for table in tables for cell in table.cells]
    means = []
    for table in tables:
        speeds = {column.id for column in table.explained} == {FPS}
        means += (
            [table.reading or (SPEEDS if speeds else MEANS)] if table.groups and (full or speeds) else []
        )
    sentences = [f"{each} {ARROWS}" for each in dict.fromkeys(means)]
    if clips := [cell.clips for cell in cells if cell.mark]:
        rare = (
            f"{max(clips)} clips can miss failures on up to {100 * unseen(max(clips)):.0f} % of all clips."
        )
        marks = f"{signs['best']} {BEST}; {signs['tied']} {TIED}."
        marks += f" {rare}" if max(clips) < CLIPS_FOR_RARE else ""
        sentences.append(marks if full else BRIEF_MARKS)
    sentences += [INTERVALS] if intervals else []
    return sentences + ([SEEDS] if any(cell.spread is not None for cell in cells) else [])


def meanings(table: Table) -> list[tuple[str, str]]:
    """(name, meaning) of every column, of n, of the kinds of missing values, of splits and of controls.

    The name of a column is its label with the unit, or its id where two columns have one label. What has
    no meaning to tell is left out.
    """
    if not table.groups:
        return []
    labels = [column.label for column in table.explained]
    pairs = []
    for column in table.explained:
        unit = shown_unit(column)
        name = column.label if labels.count(column.label) == 1 else column.id
        pairs.append((name + (f" [{unit}]" if unit else ""), column.meaning))
    kinds = dict.fromkeys(counted(group) for group in table.groups if group.counts)
    pairs += [("n (windows)" if kind == WINDOWS else "n", kind) for kind in kinds]
    pairs += [(kind, EMPTY[kind]) for kind in empty_kinds([table])]
    splits = dict.fromkeys([*(group.split for group in table.groups), *(c.split for c in table.columns)])
    pairs += [(split, table.splits.get(split, "")) for split in splits]
    rows = {row.label: row for group in table.groups for row in group.unranked if row.mark == CONTROL}
    pairs += [(label, row.about.removeprefix("Control: ")) for label, row in rows.items()]
    return [(name, meaning) for name, meaning in pairs if meaning]


def empty_kinds(tables: Sequence[Table]) -> list[str]:
    """The kinds of missing values in these tables."""
    shown = {cell.text for table in tables for cell in table.cells if cell.value is None}
    return [kind for kind in EMPTY if kind in shown]


def problem_lines(table: Table) -> list[str]:
    """A line for each method that has cases without an answer, or with odd ones: how many of each split,
    and one reason."""
    grouped: dict[tuple[str, str], list[Problem]] = {}
    for each in table.problems:
        grouped.setdefault((each.label, each.status), []).append(each)
    lines = []
    for (label, status), problems in grouped.items():
        counts: dict[str, int] = {}
        for each in problems:
            counts[each.split] = counts.get(each.split, 0) + len(each.cases)
        cases = ", ".join(f"{split} {number}" for split, number in counts.items())
        lines.append(f"{label} {ENDED.get(status, status)} some cases ({cases}): {problems[0].message}")
    return lines


# ------------------------------------------------------------------------------------ in and on a table
def common_counts(group: Group) -> list[str]:
    """Number of cases that each column is ranked on; empty where it equals the n of every ranked row."""
    counts = [f"{common.cases}" if common else "" for common in group.common]
    answered = {row.n for row in group.ranked}
    alike = len(answered) == 1 and set(counts) <= answered | {""}
    return counts if any(counts) and not alike else []


def row_name(row: Row) -> str:
    """A row's name and why it is not ranked; all controls stand below a heading that says so."""
    return f"{row.label} ({row.mark})" if row.mark not in ("", CONTROL) else row.label


def shown_unit(column: Column) -> str:
    """The unit; "" where there is none to show."""
    return column.unit if column.unit != "1" else ""


def counted(group: Group) -> str:
    """Meaning of n in one group."""
    if group.counted == "windows":
        return WINDOWS
    return N_PART if group.subject else N


def clips_and_cases(clips: int, cases: int) -> str:
    """``43 clips, 46 cases``."""
    return f"{count(clips, 'clip')}, {count(cases, 'case')}"


def brief(group: Group) -> str:
    """The meaning of the marks and what else stands below a group, in a line."""
    marks = [BRIEF_MARKS] if any(cell.mark for row in group.rows for cell in row.cells) else []
    marks = [f"{each.removesuffix('.')}, but for:" if group.below else each for each in marks]
    return " ".join([*marks, *group.below])


# ---------------------------------------------------------------------------------------------- on lines
def width(words: str) -> int:
    """Width of a printable text in a terminal, in characters."""
    wide = sum(unicodedata.east_asian_width(each) in "WF" for each in words)
    return len(words) + wide - sum(bool(unicodedata.combining(each)) for each in words)


def to_the_right(words: str, most: int) -> str:
    """A text at the right of so many characters."""
    return " " * (most - width(words)) + words


def filled(sentence: str, most: int, lead: str = "", indent: str = "") -> list[str]:
    """A text on lines of at most so many characters, none of which breaks at a hyphen, before a percent
    sign or, where it fits on a line, within a command such as ``bench table --variants``.

    Non-breaking spaces become usual ones. lead: before the first line; indent: before the others.
    """

    def joined(match: re.Match[str]) -> str:
        command = match.group()
        return command.replace(" ", NO_BREAK) if len(indent) + len(command) < most else command

    text = _COMMAND.sub(joined, sentence).replace(" %", f"{NO_BREAK}%")
    lines = textwrap.wrap(text, most, initial_indent=lead, subsequent_indent=indent, break_on_hyphens=False)
    return [line.replace(NO_BREAK, " ") for line in lines]


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
