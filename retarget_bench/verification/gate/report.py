"""Report of a check: one table of all changes, as text, and as Markdown for a pull request."""

import html
from collections.abc import Sequence

from retarget_bench.tables.builder import DEFAULT_COLUMNS
from retarget_bench.verification.gate.compare import Change, Comparison, Status

MOST = 6
"""Lines that are written out of one subject."""
HEADS = ("", "of", "value", "in", "golden", "now", "")
CURE = 'If it is meant: the same command with --accept "why".'
VERDICTS = (
    "Same: nothing moved by more than it may.",
    f"Moved. {CURE}",
    "Could not measure: see above; nothing can be accepted before it can.",
)


def text(comparison: Comparison, everything: bool = False) -> str:
    """The report for a terminal. everything: a line per change."""
    rows, rest = _rows(comparison, everything)
    sizes = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, sizes)).rstrip() for row in rows]
    return "\n".join([*lines, *rest, _counts(comparison), VERDICTS[comparison.verdict]])


def markdown(comparison: Comparison) -> str:
    """The report for ``GITHUB_STEP_SUMMARY`` or a comment."""
    rows, rest = _rows(comparison)
    verdict = ("same", "moved", "could not measure")[comparison.verdict]
    cells = [
        [html.escape(cell, quote=False).replace("|", "\\|").replace("\n", " ") for cell in row]
        for row in rows
    ]
    lines = [f"| {' | '.join(row)} |" for row in cells]
    lines[1:1] = [f"|{'---|' * len(HEADS)}"] if lines else []
    foot = [_counts(comparison), "", VERDICTS[comparison.verdict], ""]
    return "\n".join([f"### bench check: {verdict}", "", *lines, "", *rest, *foot])


def _counts(comparison: Comparison) -> str:
    moved = len(comparison.changes)
    return f"{comparison.compared} compared: {comparison.compared - moved} same, {moved} not."


def _rows(comparison: Comparison, everything: bool = False) -> tuple[list[Sequence[str]], list[str]]:
    """The cells of the lines that are shown, a heading first, and a sentence about the others.

    A change moves many values that say the same, so a line is a family of values (the part of the id before
    the dot) of one subject: the value that moved most. Default columns come first.
    """
    if everything:
        return _headed([_cells([each]) for each in comparison.changes]), []
    subjects: dict[tuple[Status, str], dict[str, list[Change]]] = {}
    for each in comparison.changes:
        families = subjects.setdefault((each.status, each.subject), {})
        families.setdefault(each.value.split(".")[0] or each.why, []).append(each)
    rows, left = [], 0
    for families in subjects.values():
        ordered = sorted(families.values(), key=lambda changes: changes[0].value not in DEFAULT_COLUMNS)
        rows += [_cells(changes) for changes in ordered[:MOST]]
        left += sum(map(len, ordered[MOST:]))
    return _headed(rows), [f"and {left} more (--all shows them)"] if left else []


def _headed(rows: list[Sequence[str]]) -> list[Sequence[str]]:
    return [HEADS, *rows] if rows else []


def _cells(changes: Sequence[Change]) -> Sequence[str]:
    most, more = changes[0], f"and {len(changes) - 1} like it" if len(changes) > 1 else ""
    why = "; ".join(filter(None, (most.why, more)))
    return most.status, most.subject, most.value, most.where, *map(_number, (most.before, most.after)), why


def _number(value: float | str | None) -> str:
    return "" if value is None else value if isinstance(value, str) else f"{value:.6g}"
