"""Report of a check: one table of what is not as it was, as text, and as Markdown for a pull request."""

from collections.abc import Sequence

from retarget_bench.verification.gate.compare import Change, Comparison

MOST = 40
"""Lines that are written out."""
HEADS = ("", "of", "value", "in", "golden", "now", "")
CURE = 'If it is meant: the same command with --accept --because "...".'
VERDICTS = (
    "Same: nothing moved by more than it may.",
    f"Moved. {CURE}",
    "Could not measure: see above; nothing can be accepted before it can.",
)


def text(found: Comparison, everything: bool = False) -> str:
    """The report for a terminal. everything: a line per change."""
    rows, rest = _rows(found, everything)
    sizes = [max(map(len, column)) for column in zip(HEADS, *rows, strict=True)]
    lines = [
        "  ".join(f"{cell:<{size}}" for cell, size in zip(row, sizes, strict=True)).rstrip()
        for row in ((HEADS, *rows) if rows else ())
    ]
    return "\n".join([*lines, *rest, _counts(found), VERDICTS[found.verdict]])


def markdown(found: Comparison) -> str:
    """The report for ``GITHUB_STEP_SUMMARY`` or a comment."""
    rows, rest = _rows(found)
    verdict = ("same", "moved", "could not measure")[found.verdict]
    lines = [f"| {' | '.join(map(_cell, row))} |" for row in ((HEADS, *rows) if rows else ())]
    lines[1:1] = [f"|{'---|' * len(HEADS)}"] if lines else []
    return "\n".join(
        [f"### bench check: {verdict}", "", *lines, "", *rest, _counts(found), "", VERDICTS[found.verdict], ""]
    )


def _counts(found: Comparison) -> str:
    moved = len(found.changes)
    return f"{found.compared} compared: {found.compared - moved} same, {moved} not."


def _rows(found: Comparison, everything: bool = False) -> tuple[list[Sequence[str]], list[str]]:
    """The cells of the lines that are shown, and a sentence about the others.

    A change moves many values that say the same, so a line is a family of values (the part of the id before
    the dot) of one subject; shown is the value that moved most.
    """
    families: dict[tuple[str, ...], list[Change]] = {}
    for number, each in enumerate(found.changes):
        key = (str(number),) if everything else (each.status, each.subject, each.value.split(".")[0])
        families.setdefault(key if each.subject else (str(number),), []).append(each)
    rows = [_cells(changes) for changes in families.values()]
    shown = rows if everything else rows[:MOST]
    left = [f"and {len(rows) - MOST} more lines (--all shows them)"] if len(shown) < len(rows) else []
    return shown, left


def _cells(changes: Sequence[Change]) -> Sequence[str]:
    most, more = changes[0], f"and {len(changes) - 1} like it" if len(changes) > 1 else ""
    why = "; ".join(filter(None, (most.why, more)))
    return most.status, most.subject, most.value, most.where, *map(_number, (most.before, most.after)), why


def _number(value: float | str | None) -> str:
    return "" if value is None else value if isinstance(value, str) else f"{value:.6g}"


def _cell(said: str) -> str:
    plain = said.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return plain.replace("|", "\\|").replace("\n", " ")
