"""Pairwise comparison of two methods: paired difference of every value, with interval and p-value."""

import difflib
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.statistics import ALPHA, ENOUGH_CLIPS, Interval
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import folded
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
    p, adjusted:   of the mean difference being 0, by sign flips over clips; adjusted for all ``compared``
                   values.
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
    compared: int
    cases: int
    clips: int

    @property
    def verdict(self) -> str:
        """``first``, ``second`` (which is better), ``higher``, ``lower`` (the first, of a description),
        ``same`` (no clip differs by more than the value's tolerance), ``few`` (no data of so many clips
        could give a verdict) or ``open`` (not significant)."""
        if not any(self.won):
            return "same"
        if self.adjusted >= ALPHA or self.clips < ENOUGH_CLIPS:
            return "open" if statistics.could_separate(self.clips, self.compared) else "few"
        if self.facts.better == "none":
            return "higher" if self.difference > 0 else "lower"
        return "first" if (self.difference > 0) == (self.facts.better == "higher") else "second"

    @property
    def clips_needed(self) -> int | None:
        """Clips that a verdict asks for where there is none: at least, of ``few``; for ``open`` about as
        many as would show this difference four times in five. None where no number would do."""
        if self.verdict == "few":
            return statistics.clips_needed(self.compared)
        if self.verdict == "open":
            return statistics.clips_for_power(self.p, self.clips, self.compared)
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


def find(matrix: ResultMatrix, name: str) -> MethodRow | None:
    """The row of a method by its label, or by an equivalent spec; None where it has no results here."""
    rows = {row.label: row for row in matrix.rows}
    return rows.get(label_of(name, rows) or "")


def label_of(name: str, labels: Collection[str]) -> str | None:
    """The label among these that a spec stands for, however it is written (``HuMoT``, ``copy rotations``);
    None where there is none."""
    if name in labels:
        return name
    alike = [label for label in labels if folded(label) == folded(name)]
    if len(alike) == 1:
        return alike[0]
    try:
        label = str(registry.canonical("methods", registry.spelled(name, ("methods",))))
    except BenchError:
        return None
    return label if label in labels else None


def unknown(having: Iterable[str], name: str) -> BenchError:
    """The error for a method that has no results at all: it lists those that have, close names first."""
    labels = sorted(set(having))
    if close := difflib.get_close_matches(name, labels, 3, 0.5):
        return BenchError(f"no results of {name!r} here; did you mean {' or '.join(close)}?")
    return BenchError(f"no results of {name!r} here; there are those of {', '.join(labels)}")


def compare(
    matrix: ResultMatrix, first: MethodRow, second: MethodRow, values: Sequence[str]
) -> PairwiseComparison:
    """The differences of two rows of a matrix, of those values that both have a number for.

    p-values are adjusted by Holm over the values compared here. Raises BenchError where the two were
    scored on different data.
    """
    contents = [row.header.dataset.content for row in (first, second)]
    if contents[0] != contents[1]:
        raise BenchError(
            f"{first.label} and {second.label} were scored on different data called {matrix.dataset} "
            f"({contents[0]}; {contents[1]}); run one of them again"
        )
    found = [_difference(matrix, first, second, value, len(values)) for value in values]
    differences = [each for each in found if each is not None]
    compared = len(differences)
    adjusted = statistics.holm(np.array([each.p for each in differences]))
    return PairwiseComparison(
        dataset=matrix.dataset,
        split=matrix.split,
        first=first.label,
        second=second.label,
        differences=tuple(
            replace(each, adjusted=float(p), compared=compared)
            for each, p in zip(differences, adjusted, strict=True)
        ),
        notes=tuple(_notes(first, second)),
    )


def _difference(
    matrix: ResultMatrix, first: MethodRow, second: MethodRow, value: str, compared: int
) -> Difference | None:
    one, two = (row.number((value, "")) for row in (first, second))
    if one is None or two is None:
        return None
    both = np.array([one, two])
    there = ~np.isnan(both).any(axis=0)
    if not there.any():
        return None
    both, clips = both[:, there], matrix.clips[there]
    facts = matrix.values[value]
    scale = statistics.losses(both, facts.better, facts.goal) if facts.better == "target" else both
    pair = statistics.per_clip(scale, clips)
    apart = statistics.differences(pair[:1], pair[1:], facts.tolerance)
    means = statistics.per_clip(both, clips).mean(axis=1)
    p = float(statistics.sign_flip(apart, compared)[0])
    higher, lower = int((apart > 0).sum()), int((apart < 0).sum())
    return Difference(
        value=value,
        facts=facts,
        first=float(means[0]),
        second=float(means[1]),
        difference=float(apart.mean()),
        won=(higher, lower) if facts.better in ("higher", "none") else (lower, higher),
        interval=statistics.paired_intervals(apart)[0],
        p=p,
        adjusted=p,
        compared=compared,
        cases=int(there.sum()),
        clips=apart.shape[1],
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
