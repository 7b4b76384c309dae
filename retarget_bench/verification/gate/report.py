"""Report of a check as text, and as Markdown for a pull request: moved rows first, then counts."""

import html
from collections import Counter
from collections.abc import Sequence

from retarget_bench.verification.gate.compare import NEW, GateRow, Status

MOST = 20
"""Lines of one status that are written out."""
CURE = 'If it is meant: the same command with --accept --because "...".'
VERDICTS = (
    "Same: everything measures what it measured.",
    f"Moved. {CURE}",
    "Could not measure: see above; nothing can be accepted before it can.",
)


def text(lines: Sequence[GateRow], verdict: int, everything: bool = False) -> str:
    """The report for a terminal."""
    out = []
    for status, found in _by_status(lines).items():
        out.append(f"{status}:")
        shown = found if everything else found[:MOST]
        width = max(len(_name(line)) for line in shown)
        for line in shown:
            why = f"({line.why})" if line.why else ""
            out.append("  ".join(filter(None, (f"  {_name(line):<{width}}", _change(line), why))).rstrip())
        if len(found) > len(shown):
            out.append(f"  and {len(found) - len(shown)} more (--all shows them): {_most(found)}")
    return "\n".join([*out, counts(lines), VERDICTS[verdict]])


def markdown(lines: Sequence[GateRow], verdict: int) -> str:
    """The report for ``GITHUB_STEP_SUMMARY`` or a comment."""
    out = [f"### bench check: {('same', 'moved', 'could not measure')[verdict]}", "", counts(lines), ""]
    for status, found in _by_status(lines).items():
        out += [f"#### {status}", "", "| row | golden, now | |", "|---|---|---|"]
        for line in found[:MOST]:
            name = " ".join(f"`{_cell(part)}`" for part in (line.subject, line.where, line.value) if part)
            out.append(f"| {name} | {_cell(_change(line))} | {_cell(html.escape(line.why, quote=False))} |")
        if len(found) > MOST:
            out += ["", f"and {len(found) - MOST} more: {html.escape(_most(found), quote=False)}"]
        out.append("")
    return "\n".join([*out, VERDICTS[verdict], ""])


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
    parts = [f"{subject} ({count} {what})" for (subject, what), count in found.most_common(8)]
    return ", ".join(parts) + (f" and {len(found) - 8} more" if len(found) > 8 else "")


def _by_status(lines: Sequence[GateRow]) -> dict[Status, list[GateRow]]:
    """The lines that are not the same. Those that cannot be compared for one reason are one line."""
    found: dict[Status, list[GateRow]] = {}
    for line in lines:
        if line.status not in (Status.SAME, Status.INCOMPARABLE):
            found.setdefault(line.status, []).append(line)
    alike = Counter((line.subject, line.why) for line in lines if line.status is Status.INCOMPARABLE)
    for (subject, why), count in alike.items():
        line = GateRow(Status.INCOMPARABLE, subject, f"{count} rows" if count > 1 else "", why=why)
        found.setdefault(Status.INCOMPARABLE, []).append(line)
    return found


def _most(lines: Sequence[GateRow]) -> str:
    """The values that the lines are of, the most frequent first."""
    found = Counter(line.value or line.subject for line in lines).most_common(6)
    return ", ".join(f"{count} {value}" for value, count in found)


def _name(line: GateRow) -> str:
    return "  ".join(part for part in (line.subject, line.where, line.value) if part)


def _change(line: GateRow) -> str:
    if line.before is None or line.after is None:
        return ""
    unit = "" if line.unit == "1" else f" {line.unit}"
    return f"{line.before:.6g} -> {line.after:.6g}{unit}"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
