"""Report of a check as text, and as Markdown for a pull request: what moved first, then counts.

A change moves many values that say the same, so a line is a family of values of one method over all splits,
and only those that moved most are written out.
"""

import html
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from retarget_bench.api import SPLITS
from retarget_bench.tables.builder import DEFAULT_COLUMNS
from retarget_bench.tables.model import count
from retarget_bench.verification.gate.compare import NEW, GateRow, Status

MOST_FAMILIES = 6
"""Families of values of one method that are written out: default columns, then those that moved most."""
MOST = 20
"""Lines of one status that are written out."""
MOST_PLACES = 3
"""Splits, or frozen motions, whose change is written out in one line."""
CURE = 'If it is meant: the same command with --accept --because "...".'
VERDICTS = (
    "Same: everything measures what it measured.",
    f"Moved. {CURE}",
    "Could not measure: see above; nothing can be accepted before it can.",
)
NO_WORSE = "No worse: nothing got worse by more than it may."
MOVES = (Status.WORSE, Status.BETTER, Status.MOVED)


@dataclass(frozen=True)
class _Entry:
    """A line of the report. rows: how many rows it stands for."""

    name: tuple[str, ...]
    change: str
    why: str
    rows: int = 1


def text(lines: Sequence[GateRow], verdict: int, everything: bool = False) -> str:
    """The report for a terminal. everything: a line per row that is not the same."""
    out = []
    for status, found in _by_status(lines).items():
        out.append(f"{status}:")
        shown, rest = ([_row(line) for line in found], "") if everything else _shown(status, found)
        width = max(len("  ".join(each.name)) for each in shown)
        for each in shown:
            why = f"({each.why})" if each.why else ""
            name = f"  {'  '.join(each.name):<{width}}"
            out.append("  ".join(filter(None, (name, each.change, why))).rstrip())
        if rest:
            out.append(f"  {rest} (--all shows them)")
    return "\n".join([*out, counts(lines), told(lines, verdict)])


def markdown(lines: Sequence[GateRow], verdict: int) -> str:
    """The report for ``GITHUB_STEP_SUMMARY`` or a comment."""
    out = [f"### bench check: {('same', 'moved', 'could not measure')[verdict]}", "", counts(lines), ""]
    for status, found in _by_status(lines).items():
        out += [f"#### {status}", "", "| row | golden, now | |", "|---|---|---|"]
        shown, rest = _shown(status, found)
        for each in shown:
            name = " ".join(f"`{_cell(part)}`" for part in each.name)
            out.append(f"| {name} | {_cell(each.change)} | {_cell(html.escape(each.why, quote=False))} |")
        out += ["", html.escape(rest, quote=False), ""] if rest else [""]
    return "\n".join([*out, told(lines, verdict), ""])


def told(lines: Sequence[GateRow], verdict: int) -> str:
    """The last line: the verdict in a sentence."""
    free = any(line.status is Status.NO_WORSE for line in lines)
    return NO_WORSE if free and not verdict else VERDICTS[verdict]


def counts(lines: Sequence[GateRow]) -> str:
    """``2850 rows: 2840 same, 10 worse``."""
    found = Counter(line.status for line in lines)
    told = ", ".join(f"{found[status]} {status}" for status in reversed(Status) if found[status])
    return f"{len(lines)} rows: {told}." if lines else "0 rows."


def moved(lines: Sequence[GateRow]) -> str:
    """One line for the log of accepted changes."""
    found = Counter(
        (line.subject, "new" if line.why == NEW else str(line.status))
        for line in lines
        if line.status is not Status.SAME
    )
    parts = [f"{subject} ({rows} {what})" for (subject, what), rows in found.most_common(8)]
    return ", ".join(parts) + (f" and {len(found) - 8} more" if len(found) > 8 else "")


def _by_status(lines: Sequence[GateRow]) -> dict[Status, list[GateRow]]:
    """The lines that are not the same. Those that cannot be compared for one reason are one line."""
    found: dict[Status, list[GateRow]] = {}
    for line in lines:
        if line.status not in (Status.SAME, Status.NO_WORSE, Status.INCOMPARABLE):
            found.setdefault(line.status, []).append(line)
    alike = Counter((line.subject, line.why) for line in lines if line.status is Status.INCOMPARABLE)
    for (subject, why), rows in alike.items():
        line = GateRow(Status.INCOMPARABLE, subject, f"{rows} rows" if rows > 1 else "", why=why)
        found.setdefault(Status.INCOMPARABLE, []).append(line)
    return found


# ------------------------------------------------------------------------------------------- shortening
def _shown(status: Status, found: Sequence[GateRow]) -> tuple[list[_Entry], str]:
    """The entries of a status that are written out, and a sentence about the others, or ""."""
    entries = list(_families(found) if status in MOVES else _alike(found))
    kept: list[_Entry] = []
    of_subject: Counter[str] = Counter()
    for each in entries:
        subject = each.name[0] if each.name else ""
        of_subject[subject] += 1
        if of_subject[subject] <= (MOST_FAMILIES if status in MOVES else MOST) and len(kept) < MOST:
            kept.append(each)
    if not (left := [each for each in entries if each not in kept]):
        return kept, ""
    names = Counter({each.name[-1]: each.rows for each in left}).most_common(6)
    listed = ", ".join(name for name, _ in names) + (", ..." if len(left) > len(names) else "")
    return kept, f"and {sum(each.rows for each in left)} more rows: {listed}"


def _families(found: Sequence[GateRow]) -> Iterator[_Entry]:
    """A family of values of one method (or of frozen motions) each: those with default columns first."""
    grouped: dict[tuple[str, str], list[GateRow]] = {}
    for line in sorted(found, key=lambda line: line.value not in DEFAULT_COLUMNS):
        grouped.setdefault((line.subject, line.family or line.value), []).append(line)
    for (subject, _), lines in grouped.items():
        if len(lines) == 1 and lines[0].before is None:
            yield _row(lines[0])
            continue
        value = lines[0].value
        leading = [line for line in lines if line.value == value]
        worst = max(leading, key=lambda line: line.size)
        told = [f"{line.where} {_change(line)}" for line in sorted(leading[:MOST_PLACES], key=_place)]
        if len(leading) > MOST_PLACES:
            told.append(f"and {len(leading) - MOST_PLACES} more")
        unit = "" if worst.unit == "1" else f" {worst.unit}"
        most = f"most {worst.where} {worst.worst}" if worst.worst else worst.why
        why = "; ".join(filter(None, (count(len(lines), "row"), most)))
        yield _Entry(tuple(filter(None, (subject, value))), ", ".join(told) + unit, why, len(lines))


def _place(line: GateRow) -> int:
    """Splits in their usual order; all else as it is."""
    return [*SPLITS, line.where].index(line.where)


def _alike(found: Sequence[GateRow]) -> Iterator[_Entry]:
    """Rows of one reason as one entry; the number of answered cases apart."""
    grouped: dict[tuple[str, str, str, bool], list[GateRow]] = {}
    for line in found:
        grouped.setdefault((line.subject, line.where, line.why, line.value == "answered"), []).append(line)
    for lines in grouped.values():
        one = lines[0] if len(lines) == 1 else replace(lines[0], value=f"{len(lines)} rows", before=None)
        yield replace(_row(one), rows=len(lines))


def _row(line: GateRow) -> _Entry:
    name = tuple(part for part in (line.subject, line.where, line.value) if part)
    unit = "" if line.unit == "1" else f" {line.unit}"
    change = "" if line.before is None else f"{line.before:.6g} -> {line.after:.6g}{unit}"
    return _Entry(name, change if line.after is not None else "", line.why)


def _change(line: GateRow) -> str:
    """``1.436 -> 1.487 (+3.6 %)``; without the share where the golden number is next to nothing."""
    if line.before is None or line.after is None:
        return ""
    digits = 4 if f"{line.before:.4g}" != f"{line.after:.4g}" else 9
    share = 100 * (line.after / line.before - 1) if line.before else 0.0
    percent = f" ({share:+.{0 if abs(share) >= 10 else 1}f} %)" if 0.05 <= abs(share) < 1000 else ""
    return f"{line.before:.{digits}g} -> {line.after:.{digits}g}{percent}"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
