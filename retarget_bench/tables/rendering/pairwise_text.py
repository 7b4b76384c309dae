"""A comparison of two methods as text, Markdown or comma-separated values."""

import math
import textwrap
from collections.abc import Callable, Sequence

from retarget_bench.analysis.pairwise import Difference, PairwiseComparison
from retarget_bench.analysis.statistics import ALPHA, CLIPS_FOR_RARE, ENOUGH_CLIPS, POWER, RARE, unseen
from retarget_bench.files import spreadsheet
from retarget_bench.tables.model import ARROWS, count
from retarget_bench.tables.rendering.as_markdown import line, plain
from retarget_bench.tables.rendering.as_text import WIDTH
from retarget_bench.tables.rendering.words import to_the_right, width

HEADS = ("", "{first}", "{second}", "difference", "95 % interval", "p", "cases", "clips", "won", "")
LEGEND = (
    "Means over clips of the mean per clip, over the cases that both have. Difference: {first} minus "
    "{second}; where a value is best at a goal, of their distances |ln(value / goal)|.",
    "p: paired sign flips over clips, significant below 0.05; adjusted for all methods in the table where "
    "one of the two is its best, as there, and else for the values compared in a split.",
    "Intervals (without that adjustment) and p hold for these characters only. Intervals need "
    f"{ENOUGH_CLIPS} clips, verdicts as many or more.",
    "won: clips on which {first} and {second} are better. About N clips: with so many, this difference "
    f"would be significant in {100 * POWER:g} % of samples, were it the true one.",
)
OF_SETS = (
    "FID and other values of all answers as one set: cases are windows, and tests and won are over tenths "
    "of the clips, by the paired jackknife; p as above, or adjusted for such values alone."
)
CASES = HEADS.index("cases") - 1
"""The place of the number of cases among numbers."""
BESIDE_MEANS = 58
"""The characters of a line that are not for the two means and the names of methods above them."""
SUCH = "on such clips"
SUCH_LEGEND = (
    SUCH + ": {clips} clips can miss failures on up to {share:.0f} % of all clips, and the verdict leaves "
    f"those aside; without these words a verdict needs {CLIPS_FOR_RARE} clips ({100 * RARE:g} %)."
)
MOST_CLIPS = 10_000
"""Where a verdict would need more, no number is shown."""


def text(comparisons: Sequence[PairwiseComparison], columns: int = WIDTH) -> str:
    """For a terminal of at least 80 columns: a block per split, in which every value has a line with its
    name and verdict above its numbers."""
    out = []
    for each in comparisons:
        title = f"{_title(each)}; {_cases(each)}"
        out += textwrap.wrap(title, columns, break_long_words=False, break_on_hyphens=False)
        out += ["", *_lines(each, columns), ""]
        notes = [textwrap.wrap(f"* {note}", columns, subsequent_indent="  ") for note in each.notes]
        out += [*(line for note in notes for line in note), *([""] if notes else [])]
    legend = [line for words in _legend(comparisons) for line in textwrap.wrap(words, columns)]
    return "\n".join([*out, *legend]) + "\n"


def _title(comparison: PairwiseComparison) -> str:
    return f"{comparison.first} against {comparison.second}: {comparison.dataset}, {comparison.split}"


def _lines(comparison: PairwiseComparison, columns: int) -> list[str]:
    """The numbers aligned below their headings, without those of cases."""
    rows = [_row(comparison, one) for one in comparison.differences]
    head = [comparison.first, comparison.second, *HEADS[3:-1]]
    if max(map(width, head[:2])) > (columns - BESIDE_MEANS) // 2:
        head[:2] = ["first", "second"]
    table = [[*row[:CASES], *row[CASES + 1 :]] for row in (head, *(row[1:-1] for row in rows))]
    sizes = [max(map(width, column)) for column in zip(*table, strict=True)]
    numbers = [
        "  " + "".join(f"  {to_the_right(cell, size)}" for cell, size in zip(row, sizes, strict=True))
        for row in table
    ]
    lines = numbers[:1]
    for row, below in zip(rows, numbers[1:], strict=True):
        heading = f"{row[0]}: {row[-1]}"
        lines += [*textwrap.wrap(heading, columns, initial_indent="  ", subsequent_indent="    "), below]
    return [line.rstrip() for line in lines]


def _cases(comparison: PairwiseComparison) -> str:
    """The number of cases, or the range of these; of windows where all values are of sets."""
    of_cases = [one.cases for one in comparison.differences if not one.structure]
    least, *_, most = sorted((of_cases or [one.cases for one in comparison.differences]) * 2)
    return count(most, "case") if least == most else f"{least} to {count(most, 'case')}"


def markdown(comparisons: Sequence[PairwiseComparison]) -> str:
    """A table per split, with a legend."""
    out = []
    for each in comparisons:
        head = [words.format(first=each.first, second=each.second) for words in HEADS]
        out += [f"### {plain(_title(each))}", "", line(map(plain, head))]
        out.append("|---|" + "---:|" * (len(HEADS) - 2) + "---|")
        out += [line(map(plain, _row(each, one))) for one in each.differences]
        out += ["", *(f"- {plain(note)}" for note in each.notes), *([""] if each.notes else [])]
    return "\n".join([*out, *(f"- {plain(sentence)}" for sentence in _legend(comparisons))]) + "\n"


def comma_separated(comparisons: Sequence[PairwiseComparison]) -> str:
    """A line per split and value; full precision; empty where there is no interval."""
    names = ("first_mean", "second_mean", "difference", "low", "high", "p", "p_adjusted")
    counts = ("cases", "clips", "first_won", "second_won", "verdict", "clips_needed")
    lines: list[list[object]] = [
        ["dataset", "split", "first", "second", "value", "structure", *names, *counts]
    ]
    for each in comparisons:
        for one in each.differences:
            ends = (one.interval.low, one.interval.high) if one.interval else (None, None)
            numbers = (one.first, one.second, one.difference, *ends, one.p, one.adjusted)
            shown = ["" if number is None else f"{number:.9g}" for number in numbers]
            words = [one.cases, one.clips, *one.won, verdict(each, one), one.clips_needed]
            about = [each.dataset, each.split, each.first, each.second, one.value, one.structure]
            lines.append([*about, *shown, *words])
    return spreadsheet(lines)


def verdict(comparison: PairwiseComparison, one: Difference) -> str:
    """The verdict in words."""
    words = {
        "first": f"{comparison.first} better",
        "second": f"{comparison.second} better",
        "higher": f"{comparison.first} higher",
        "lower": f"{comparison.first} lower",
        "same": "the same",
        "equal": "equal means",
        "few": "too few clips",
        "open": "not significant",
        "withheld": "no verdict",
    }[one.verdict]
    return f"{words} {SUCH}" if one.limited else words


def _needed(one: Difference) -> str:
    """Number of clips that a verdict needs, where there is none."""
    needed = one.clips_needed
    if needed is None or needed > MOST_CLIPS:
        return ""
    return f", needs {needed}" if one.verdict == "few" else f" (about {float(f'{needed:.2g}'):.0f} clips)"


def _row(comparison: PairwiseComparison, one: Difference) -> list[str]:
    """The cells below ``HEADS``, as text."""
    facts, interval, same = one.facts, one.interval, one.verdict == "same"
    goal = f"{facts.goal:g}" if facts.better == "target" else ""
    unit = f", {facts.unit}" if facts.unit != "1" else ""
    name = f"{facts.label} {ARROWS[facts.better]}{goal}".rstrip() + unit
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
        verdict(comparison, one) + _needed(one),
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


def _legend(comparisons: Sequence[PairwiseComparison]) -> list[str]:
    names = {(each.first, each.second) for each in comparisons}
    first, second = names.pop() if len(names) == 1 else ("the first", "the second")
    lines = [line.replace("{first}", first).replace("{second}", second) for line in LEGEND]
    lines += [OF_SETS] if any(one.structure for each in comparisons for one in each.differences) else []
    few = min((one.clips for each in comparisons for one in each.differences if one.limited), default=0)
    return [*lines, SUCH_LEGEND.format(clips=few, share=100 * unseen(few))] if few else lines


RENDERERS: dict[str, Callable[[Sequence[PairwiseComparison]], str]] = {
    "text": text,
    "md": markdown,
    "csv": comma_separated,
}
