"""Report of a check as text, and as Markdown for a pull request: moved rows first, then counts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from retarget_bench.verification.gate.compare import NEW, Line, Mark

MOST = 20
"""Lines of one mark that are written out."""
CURE = 'If it is meant: the same command with --accept --because "...".'
VERDICTS = (
    "Same: everything measures what it measured.",
    f"Moved. {CURE}",
    "Could not measure: see above; nothing can be accepted before it can.",
)


def text(lines: Sequence[Line], verdict: int, everything: bool = False) -> str:
    """The report for a terminal."""
    out = []
    for mark, found in _by_mark(lines).items():
        out.append(f"{mark}:")
        shown = found if everything else found[:MOST]
        width = max(len(_name(line)) for line in shown)
        out += [f"  {_name(line):<{width}}  {_numbers(line)}".rstrip() for line in shown]
        if len(found) > len(shown):
            out.append(f"  and {len(found) - len(shown)} more (--all shows them): {_most(found)}")
    return "\n".join([*out, counts(lines), VERDICTS[verdict]])


def markdown(lines: Sequence[Line], verdict: int) -> str:
    """The report for ``GITHUB_STEP_SUMMARY`` or a comment."""
    out = [f"### bench check: {('same', 'moved', 'could not measure')[verdict]}", "", counts(lines), ""]
    for mark, found in _by_mark(lines).items():
        out += [f"#### {mark}", "", "| row | golden, now | |", "|---|---|---|"]
        for line in found[:MOST]:
            name = " ".join(f"`{_cell(part)}`" for part in (line.subject, line.where, line.value) if part)
            out.append(f"| {name} | {_cell(_change(line))} | {_cell(_escaped(line.why))} |")
        if len(found) > MOST:
            out += ["", f"and {len(found) - MOST} more: {_escaped(_most(found))}"]
        out.append("")
    return "\n".join([*out, VERDICTS[verdict], ""])


def counts(lines: Sequence[Line]) -> str:
    """``2850 rows: 2840 same, 10 worse``."""
    found = Counter(line.mark for line in lines)
    told = ", ".join(f"{found[mark]} {mark}" for mark in reversed(Mark) if found[mark])
    return f"{len(lines)} rows: {told}." if lines else "0 rows."


def moved(lines: Sequence[Line]) -> str:
    """One line for the log of accepted changes."""
    found = Counter(
        (line.subject, "new" if line.why == NEW else str(line.mark))
        for line in lines
        if line.mark is not Mark.SAME
    )
    parts = [f"{subject} ({count} {what})" for (subject, what), count in found.most_common(8)]
    return ", ".join(parts) + (f" and {len(found) - 8} more" if len(found) > 8 else "")


def _by_mark(lines: Sequence[Line]) -> dict[Mark, list[Line]]:
    """The lines that are not the same. Those that cannot be compared for one reason are one line."""
    found: dict[Mark, list[Line]] = {}
    for line in lines:
        if line.mark not in (Mark.SAME, Mark.INCOMPARABLE):
            found.setdefault(line.mark, []).append(line)
    if folded := _folded([line for line in lines if line.mark is Mark.INCOMPARABLE]):
        found[Mark.INCOMPARABLE] = folded
    return found


def _folded(lines: Sequence[Line]) -> list[Line]:
    grouped: dict[tuple[str, str], int] = Counter((line.subject, line.why) for line in lines)
    return [
        Line(Mark.INCOMPARABLE, subject, f"{count} rows" if count > 1 else "", why=why)
        for (subject, why), count in grouped.items()
    ]


def _most(lines: Sequence[Line]) -> str:
    """The values that the lines are of, the most frequent first."""
    found = Counter(line.value or line.subject for line in lines).most_common(6)
    return ", ".join(f"{count} {value}" for value, count in found)


def _name(line: Line) -> str:
    return "  ".join(part for part in (line.subject, line.where, line.value) if part)


def _numbers(line: Line) -> str:
    return "  ".join(part for part in (_change(line), f"({line.why})" if line.why else "") if part)


def _change(line: Line) -> str:
    if line.before is None or line.after is None:
        return ""
    unit = "" if line.unit == "1" else f" {line.unit}"
    return f"{line.before:.6g} -> {line.after:.6g}{unit}"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
