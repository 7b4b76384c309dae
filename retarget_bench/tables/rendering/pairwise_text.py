"""A comparison of two methods as text, Markdown or comma-separated values."""

import csv
import io
import math
import textwrap
from collections.abc import Callable, Sequence

from retarget_bench.analysis.pairwise import Difference, PairwiseComparison
from retarget_bench.analysis.statistics import ALPHA, CLIPS_FOR_RARE, ENOUGH_CLIPS, POWER, RARE, unseen
from retarget_bench.tables.model import ARROWS
from retarget_bench.tables.rendering.as_markdown import line, plain

WIDTH = 108
HEADS = ("", "{first}", "{second}", "difference", "95 % interval", "p", "cases", "clips", "won", "")
LEGEND = (
    "Means over clips of the mean per clip, over the cases that both have. Difference: {first} minus "
    "{second}; where a value is best at a goal, of their distances |ln(value / goal)|.",
    "p: paired sign-flip test over clips, adjusted for the values compared in a split (Holm); significant "
    "below 0.05.",
    "Intervals (without that adjustment) and p hold for these characters only. Intervals need "
    f"{ENOUGH_CLIPS} clips, verdicts as many or more.",
    "won: clips on which {first} and {second} are better. About N clips: with so many, this difference "
    f"would be significant in {100 * POWER:g} % of samples, were it the true one.",
)
SUCH = "on such clips"
SUCH_LEGEND = (
    SUCH + ": {clips} clips can miss failures on up to {share:.0f} % of all clips, and the verdict leaves "
    f"those aside; without these words a verdict needs {CLIPS_FOR_RARE} clips ({100 * RARE:g} %)."
)
MOST_CLIPS = 10_000
"""Where a verdict would need more, no number is shown."""


def text(found: Sequence[PairwiseComparison]) -> str:
    """For a terminal: a block per split, aligned."""
    out = []
    for each in found:
        title = f"{each.first} against {each.second}: {each.dataset}, {each.split}"
        rows = _cells(each)
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        out += [title, ""]
        for row in rows:
            middle = (cell.rjust(width) for cell, width in zip(row[1:-1], widths[1:-1], strict=True))
            out.append("  ".join(["", row[0].ljust(widths[0]), *middle, row[-1]]).rstrip())
        out += ["", *(f"* {note}" for note in each.notes), *([""] if each.notes else [])]
    legend = [line for words in _legend(found) for line in textwrap.wrap(words, WIDTH)]
    return "\n".join([*out, *legend]) + "\n"


def markdown(found: Sequence[PairwiseComparison]) -> str:
    """A table per split, with a legend."""
    out = []
    for each in found:
        head, *rows = [line([plain(cell) for cell in row]) for row in _cells(each)]
        out += [f"### {plain(f'{each.first} against {each.second}: {each.dataset}, {each.split}')}", ""]
        out += [head, "|---|" + "---:|" * (len(HEADS) - 2) + "---|", *rows]
        out += ["", *(f"- {plain(note)}" for note in each.notes), *([""] if each.notes else [])]
    return "\n".join([*out, *(f"- {plain(sentence)}" for sentence in _legend(found))]) + "\n"


def comma_separated(found: Sequence[PairwiseComparison]) -> str:
    """A line per split and value; full precision; empty where there is no interval."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    names = ("first_mean", "second_mean", "difference", "low", "high", "p", "p_holm")
    counts = ("cases", "clips", "first_won", "second_won", "verdict", "clips_needed")
    writer.writerow(["dataset", "split", "first", "second", "value", *names, *counts])
    for each in found:
        for one in each.differences:
            ends = (one.interval.low, one.interval.high) if one.interval else (None, None)
            numbers = (one.first, one.second, one.difference, *ends, one.p, one.adjusted)
            shown = ["" if number is None else f"{number:.9g}" for number in numbers]
            words = [one.cases, one.clips, *one.won, verdict(each, one), one.clips_needed]
            writer.writerow([each.dataset, each.split, each.first, each.second, one.value, *shown, *words])
    return out.getvalue()


def verdict(found: PairwiseComparison, one: Difference) -> str:
    """The verdict in words."""
    words = {
        "first": f"{found.first} better",
        "second": f"{found.second} better",
        "higher": f"{found.first} higher",
        "lower": f"{found.first} lower",
        "same": "the same",
        "few": "too few clips",
        "open": "not significant",
    }[one.verdict]
    return f"{words} {SUCH}" if one.limited else words


def _needed(one: Difference) -> str:
    """Number of clips that a verdict needs, where there is none."""
    needed = one.clips_needed
    if needed is None or needed > MOST_CLIPS:
        return ""
    return f", needs {needed}" if one.verdict == "few" else f" (about {float(f'{needed:.2g}'):.0f} clips)"


def _cells(found: PairwiseComparison) -> list[list[str]]:
    """The heading and a row per value, as text."""
    head = [words.format(first=found.first, second=found.second) for words in HEADS]
    return [head, *(_row(found, one) for one in found.differences)]


def _row(found: PairwiseComparison, one: Difference) -> list[str]:
    facts, interval, same = one.facts, one.interval, one.verdict == "same"
    goal = f"{facts.goal:g}" if facts.better == "target" else ""
    unit = f", {facts.unit}" if facts.unit != "1" else ""
    name = f"{one.value} {ARROWS[facts.better]}{goal}".rstrip() + unit
    decimals = _decimals(max(abs(one.first), abs(one.second)))
    # a difference has the decimals of its uncertainty, or of its own size
    uncertainty = (interval.high - interval.low) / 2 if interval else 0.0
    fine = max(0, _decimals(uncertainty or abs(one.difference)) - 1)
    shown = f"[{interval.low:+.{fine}f}, {interval.high:+.{fine}f}]" if interval else "–"
    return [
        name,
        f"{one.first:.{decimals}f}",
        f"{one.second:.{decimals}f}",
        *(["0", "", ""] if same else [f"{one.difference:+.{fine}f}", shown, _p(one.adjusted)]),
        str(one.cases),
        str(one.clips),
        "" if same else f"{one.won[0]}:{one.won[1]}",
        verdict(found, one) + _needed(one),
    ]


def _p(p: float) -> str:
    """A p-value as text, never rounded across the significance level."""
    if p < 0.001:
        return "<0.001"
    shown = f"{p:.3f}"
    return shown if (float(shown) < ALPHA) == (p < ALPHA) else f"<{ALPHA:g}"


def _decimals(size: float) -> int:
    """Decimals that show three significant digits of a number of this size."""
    return min(9, max(0, 2 - math.floor(math.log10(size)))) if size > 0 else 2


def _legend(found: Sequence[PairwiseComparison]) -> list[str]:
    names = {(each.first, each.second) for each in found}
    first, second = names.pop() if len(names) == 1 else ("the first", "the second")
    lines = [line.replace("{first}", first).replace("{second}", second) for line in LEGEND]
    few = min((one.clips for each in found for one in each.differences if one.limited), default=0)
    return [*lines, SUCH_LEGEND.format(clips=few, share=100 * unseen(few))] if few else lines


RENDERERS: dict[str, Callable[[Sequence[PairwiseComparison]], str]] = {
    "text": text,
    "md": markdown,
    "csv": comma_separated,
}
