"""Pairwise comparison of two methods: paired difference of every value, with interval and p-value."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.ranking import doubt, ranked_cases
from retarget_bench.analysis.statistics import ALPHA, ENOUGH_CLIPS, Interval
from retarget_bench.errors import BenchError
from retarget_bench.results import compatibility
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix


@dataclass(frozen=True)
class Difference:
    """One value of two methods, over the cases that both have it for.

    first, second: means over clips, in the value's unit.
    difference:    of the first from the second, in the value's unit; where a value is best at a goal, of
                   their distances |log(value / goal)| from it.
    won:           clips on which the first is better, and the second (of a description: higher, lower).
    withheld:      why there is no verdict, though there may be clips enough; "" where there is one.
    p, adjusted:   of the mean difference being 0, by sign flips over clips; adjusted as ``compare`` says.
    """

    value: str
    facts: DeclaredValue
    first: float
    second: float
    difference: float
    won: tuple[int, int]
    interval: Interval | None
    p: float
    adjusted: float
    cases: int
    clips: int
    withheld: str = ""

    @property
    def verdict(self) -> str:
        """``first``, ``second`` (which is better), ``higher``, ``lower`` (the first, of a description),
        ``same`` (no clip differs by more than the value's tolerance), ``few`` (too few clips for a
        verdict), ``open`` (not significant) or ``withheld``."""
        if not any(self.won):
            return "same"
        if self.withheld:
            return "withheld"
        if self.clips < ENOUGH_CLIPS:
            return "few"
        if self.adjusted >= ALPHA:
            return "open"
        if self.facts.better == "none":
            return "higher" if self.difference > 0 else "lower"
        return "first" if (self.difference > 0) == (self.facts.better == "higher") else "second"

    @property
    def clips_needed(self) -> int | None:
        """Clips that a verdict asks for where there is none: at least, of ``few``; for ``open`` about as
        many as would show this difference four times in five. None where no number would do."""
        if self.verdict == "few":
            return ENOUGH_CLIPS
        if self.verdict == "open":
            return statistics.clips_for_power(self.p, self.adjusted, self.clips)
        return None

    @property
    def limited(self) -> bool:
        """True if the verdict leaves rare failures aside, which so few clips can miss."""
        decided = self.verdict in ("first", "second", "higher", "lower")
        return decided and self.clips < statistics.CLIPS_FOR_RARE


@dataclass(frozen=True)
class PairwiseComparison:
    """Two methods on one split of one data set; ``notes`` are sentences for the reader."""

    dataset: str
    split: str
    first: str
    second: str
    differences: tuple[Difference, ...]
    notes: tuple[str, ...]


def compare(
    matrix: ResultMatrix,
    first: MethodRow,
    second: MethodRow,
    values: Sequence[str],
    table: ResultMatrix | None = None,
) -> PairwiseComparison:
    """The differences of two rows of a matrix, of those values that both have a number for.

    table: the rows of the matrix that a table shows. Where both are ranked there, they are compared over
    the table's cases, and where one of them is its best, its verdict holds. p-values of all else are
    adjusted over the values compared here. Raises BenchError where the two were scored on different data.
    """
    contents = [row.header.dataset.content for row in (first, second)]
    if contents[0] != contents[1]:
        raise BenchError(
            f"{first.label} and {second.label} were scored on different data called {matrix.dataset} "
            f"({contents[0]}; {contents[1]}); run one of them again"
        )
    pairs = [pair for value in values if (pair := _pair(matrix, first, second, value, table)) is not None]
    own = [pair.apart for pair in pairs if pair.p is None]
    adjusted = iter(statistics.step_down(np.array(own)) if own else ())
    return PairwiseComparison(
        dataset=matrix.dataset,
        split=matrix.split,
        first=first.label,
        second=second.label,
        differences=tuple(
            _difference(pair, float(next(adjusted)) if pair.p is None else pair.p) for pair in pairs
        ),
        notes=(*_notes(first, second), *_withheld(pairs)),
    )


def _withheld(pairs: Sequence["_Pair"]) -> list[str]:
    reasons: dict[str, list[str]] = {}
    for pair in pairs:
        if pair.withheld:
            reasons.setdefault(pair.withheld, []).append(pair.facts.label)
    return [f"no verdict by {', '.join(labels)}: {reason}" for reason, labels in reasons.items()]


@dataclass(frozen=True)
class _Pair:
    """One value of two methods over the cases that count.

    means: of both. apart: ``(clips,)`` differences, nan where a clip has none. p: the table's, if any.
    withheld: why there is no verdict, or "".
    """

    value: str
    facts: DeclaredValue
    means: tuple[float, float]
    apart: np.ndarray
    cases: int
    p: float | None
    withheld: str


def _pair(
    matrix: ResultMatrix, first: MethodRow, second: MethodRow, value: str, table: ResultMatrix | None
) -> _Pair | None:
    one, two = (row.number((value, "")) for row in (first, second))
    if one is None or two is None:
        return None
    both = np.array([one, two])
    p, labels = None, {first.label, second.label}
    if table is not None and (ranked := ranked_cases(table, value)) is not None:
        ranking, common = ranked
        if labels <= set(ranking.order):
            both = np.where(common, both, np.nan)
            others = labels - {ranking.best}
            p = ranking.p[others.pop()] if len(others) == 1 < len(labels) else None
    both[:, np.isnan(both).any(axis=0)] = np.nan
    cases = int((~np.isnan(both[0])).sum())
    if not cases:
        return None
    facts = matrix.values[value]
    scale = statistics.losses(both, facts.better, facts.goal) if facts.better == "target" else both
    pair = statistics.per_clip(scale, matrix.clips)
    means = np.nanmean(statistics.per_clip(both, matrix.clips), axis=1)
    apart = statistics.differences(pair[0], pair[1], facts.tolerance)
    waiting = first.header.waiting or second.header.waiting
    withheld = "cases are missing" if waiting else doubt(matrix, value)
    return _Pair(value, facts, (float(means[0]), float(means[1])), apart, cases, p, withheld)


def _difference(pair: _Pair, adjusted: float) -> Difference:
    apart = pair.apart[~np.isnan(pair.apart)]
    least = pair.facts.tolerance
    higher, lower = int((apart > least).sum()), int((apart < -least).sum())
    return Difference(
        value=pair.value,
        facts=pair.facts,
        first=pair.means[0],
        second=pair.means[1],
        difference=float(apart.mean()),
        won=(higher, lower) if pair.facts.better in ("higher", "none") else (lower, higher),
        interval=statistics.paired_intervals(apart[None])[0],
        p=float(statistics.sign_flip(apart[None])[0]),
        adjusted=1.0 if abs(apart.mean()) <= least else adjusted,
        cases=pair.cases,
        clips=len(apart),
        withheld=pair.withheld,
    )


def so_far(row: MethodRow) -> str:
    """How many cases a method has done; "" where it has done all."""
    waiting, asked = len(row.header.waiting), row.header.counts.asked
    return f"{row.label}: {asked - waiting} of {asked} cases so far" if waiting else ""


def _notes(first: MethodRow, second: MethodRow) -> list[str]:
    notes = []
    for row in (first, second):
        method, counts = row.header.method, row.header.counts
        if method.privileged:
            seen = ", ".join(name.replace("_", " ") for name in method.privileged)
            notes.append(f"{row.label} sees {seen}")
        if method.control:
            notes.append(f"{row.label} is a control")
        if sentence := so_far(row):
            notes.append(sentence)
        elif counts.ok < counts.asked:
            notes.append(f"{row.label} answered {counts.ok} of {counts.asked} cases")
        if len(row.runs) > 1:
            notes.append(f"{row.label}: mean of {len(row.runs)} seeds in every case")
    one, two = (compatibility.metric_versions(row.header) for row in (first, second))
    notes += [
        f"{name} scored them in versions {one[name]} and {two[name]}: its values are left out"
        for name in one
        if name in two and one[name] != two[name]
    ]
    return notes
