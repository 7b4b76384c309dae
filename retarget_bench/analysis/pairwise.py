"""Pairwise comparison of two methods: paired difference of every value, with interval and p-value."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.ranking import Ranking, doubt
from retarget_bench.analysis.statistics import ALPHA, ENOUGH_CLIPS, Interval
from retarget_bench.analysis.summary import PEOPLE_SET, of_set, stored_sets
from retarget_bench.api import TWO_LEGS
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import compatibility
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix, set_values


@dataclass(frozen=True)
class Difference:
    """One value of two methods, over the cases that both have it for.

    first, second: means over clips, in the value's unit.
    apart:         ``(clips,)`` differences of the first from the second, in the value's unit; where a value
                   is best at a goal, of their distances |log(value / goal)| from it. nan where there is
                   none. Of values of sets ``(10,)``, by tenths of the clips.
    cases, clips:  how many they are over; of values of sets windows, and the clips that these are of.
    withheld:      why there is no verdict, though there may be clips enough; "" where there is one.
    adjusted:      the p-value, adjusted as ``compare`` says.
    equal:         whether the means count as equal: both methods share the best mark of the table, or,
                   where the table does not compare them, the means are within the value's tolerance.
    structure:     of the targets, of values of sets; "" of values of cases.
    """

    value: str
    facts: DeclaredValue
    first: float
    second: float
    apart: np.ndarray = field(compare=False, repr=False)
    cases: int
    clips: int
    withheld: str = ""
    adjusted: float = 1.0
    equal: bool = False
    structure: str = ""

    @cached_property
    def there(self) -> np.ndarray:
        """``apart`` without what is missing."""
        present: np.ndarray = self.apart[~np.isnan(self.apart)]
        return present

    @property
    def difference(self) -> float:
        return float(self.there.mean())

    @property
    def won(self) -> tuple[int, int]:
        """Clips on which the first is better, and the second; of a description: higher, lower."""
        least = self.facts.tolerance
        higher, lower = int((self.there > least).sum()), int((self.there < -least).sum())
        return (higher, lower) if self.facts.better in ("higher", "none") else (lower, higher)

    @cached_property
    def interval(self) -> Interval | None:
        return statistics.paired_intervals(self.there[None])[0]

    @cached_property
    def p(self) -> float:
        """Of the mean difference being 0, by sign flips over clips, not adjusted."""
        return float(statistics.sign_flip(self.there[None])[0])

    @property
    def verdict(self) -> str:
        """``first``, ``second`` (which is better), ``higher``, ``lower`` (the first, of a description),
        ``same`` (no clip differs by more than the value's tolerance), ``equal`` (the means do not), ``few``
        (too few clips for a verdict), ``open`` (not significant) or ``withheld``."""
        if not any(self.won):
            return "same"
        if self.withheld:
            return "withheld"
        if self.equal:
            return "equal"
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
    rankings: Mapping[str, Ranking] = MappingProxyType({}),
) -> PairwiseComparison:
    """The differences of two rows of a matrix, of those values that both have a number for.

    rankings: value id -> that of a table of the matrix. Where it has both rows, they are compared over the
    table's cases, and where one of them is its best, its p-value holds. All other p-values are adjusted
    over the values compared here, those of sets and those of cases apart. Raises BenchError where the two
    were scored on different data.
    """
    contents = [row.header.dataset.content for row in (first, second)]
    if contents[0] != contents[1]:
        raise BenchError(
            f"{first.label} and {second.label} were scored on different data called {matrix.dataset} "
            f"({contents[0]}; {contents[1]}); run one of them again"
        )
    both = {first.label, second.label}
    there = {key: rankings[key] for key in values if key in rankings}
    of_table = {key: each for key, each in there.items() if both <= set(each.order)}
    of_best = {key: known for key, each in of_table.items() if (known := _of_best(each, both)) is not None}
    of_cases = [_of_cases(matrix, first, second, value, of_table.get(value)) for value in values]
    sets = [stored_sets(matrix, row) for row in (first, second)]
    versions = [compatibility.metric_versions(row.header) for row in (first, second)]
    declared = {
        key: each
        for key, each in set_values(row.header for row in (first, second)).items()
        if versions[0].get(each.metric) == versions[1].get(each.metric)
    }
    of_sets = [each for key in values if key in declared for each in _of_sets(declared[key], key, *sets)]
    of_sets = [each for each in of_sets if each.structure != TWO_LEGS or matrix.bodies]  # as in tables
    differences = [
        *_adjusted([each for each in of_cases if each], of_best),
        *_adjusted(of_sets, of_best),
    ]
    withheld: dict[str, list[str]] = {}
    for each in differences:
        if each.withheld:
            withheld.setdefault(each.withheld, []).append(each.facts.label)
    without = [f"no verdict by {', '.join(labels)}: {reason}" for reason, labels in withheld.items()]
    return PairwiseComparison(
        dataset=matrix.dataset,
        split=matrix.split,
        first=first.label,
        second=second.label,
        differences=tuple(sorted(differences, key=lambda each: list(values).index(each.value))),
        notes=(*_notes(first, second), *without),
    )


Known = tuple[float, bool]
"""The p-value of two methods in a table, and whether they share its best mark."""


def _of_best(ranking: Ranking, both: set[str]) -> Known | None:
    """What a table knows of two methods of which one is its best, or equal to it; None of others."""
    others = both - set(ranking.order[: ranking.equal])
    if len(both) < 2 or others == both:
        return None
    return (ranking.p[others.pop()], False) if others else (1.0, True)


def _adjusted(family: Sequence[Difference], of_best: Mapping[str, Known]) -> list[Difference]:
    """Differences with their p-values: what a table knows by value id, and those of the others as a
    family."""
    of_table = [of_best.get(each.value) if each.structure in ("", TWO_LEGS) else None for each in family]
    rest = [each.apart for each, known in zip(family, of_table, strict=True) if known is None]
    own = iter(statistics.step_down(np.array(rest)) if rest else ())
    adjusted = []
    for each, known in zip(family, of_table, strict=True):
        if known is None:
            p, near = float(next(own)), abs(each.difference) <= each.facts.tolerance
            known = (1.0 if near else p), near
        adjusted.append(replace(each, adjusted=known[0], equal=known[1]))
    return adjusted


def _of_cases(
    matrix: ResultMatrix, first: MethodRow, second: MethodRow, value: str, ranking: Ranking | None
) -> Difference | None:
    """A value of cases, over those of the ranking if there is one; None where no case has it of both."""
    one, two = (row.number((value, "")) for row in (first, second))
    if one is None or two is None:
        return None
    both = np.array([one, two])
    if ranking is not None and ranking.common is not None:
        both[:, ~ranking.common] = np.nan
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
    return Difference(
        value=value,
        facts=facts,
        first=float(means[0]),
        second=float(means[1]),
        apart=apart,
        cases=cases,
        clips=int((~np.isnan(apart)).sum()),
        withheld=withheld,
    )


def _of_sets(
    facts: DeclaredValue, key: str, one: Sequence[SetValue], two: Sequence[SetValue]
) -> Iterator[Difference]:
    """A value of every set of which both have one with an interval, over the same windows: the paired
    jackknife over tenths of the clips."""
    for first in (each for each in one if each.value_id == key):
        which = first.structure, first.kind
        second = of_set(two, key, which)
        if second is None or first.real != second.real:
            continue
        if first.tenths is None or second.tenths is None:
            continue
        structure = " ".join(filter(None, which))
        label = facts.label if which == PEOPLE_SET else f"{facts.label}, {structure}"
        yield Difference(
            value=key,
            facts=replace(facts, label=label),
            first=float(first.tenths.mean()),
            second=float(second.tenths.mean()),
            apart=statistics.differences(first.tenths, second.tenths, facts.tolerance),
            cases=first.n,
            clips=first.clips,
            structure=structure,
        )


def so_far(row: MethodRow) -> str:
    """How many cases a method has done; "" where it has done all."""
    waiting, total = len(row.header.waiting), row.header.counts.asked
    return f"{row.label}: {total - waiting} of {total} cases so far" if waiting else ""


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
