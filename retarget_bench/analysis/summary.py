"""Means, rankings and ties: values averaged per source clip, then over clips, by method and split."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.breakdown import By, breakdown, lasting
from retarget_bench.analysis.on_demand import OnDemand
from retarget_bench.analysis.selection import PEOPLE, Selection
from retarget_bench.analysis.statistics import Interval
from retarget_bench.api import TWO_LEGS
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import set_metrics, timing
from retarget_bench.results import case_metadata
from retarget_bench.results.header import DeclaredValue, MethodInfo, ResultHeader
from retarget_bench.results.metres import in_metres
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix, result_matrices
from retarget_bench.results.store import ResultPaths

COVERAGE = 0.95
"""A method that has a value for a smaller share of the cases than others is not ranked by it."""


@dataclass(frozen=True)
class Mean:
    """A mean over clips. ``n`` counts cases, ``clips`` the source clips they come from.

    interval: 95 %, over clips; None below ``statistics.ENOUGH_CLIPS`` clips.
    """

    value: float
    n: int
    clips: int
    interval: Interval | None = None


@dataclass(frozen=True)
class Ranking:
    """Order of the ranked methods by one value, on the cases that all of them have it for.

    Values that are best at a goal are compared as |log(value / goal)| of every case.

    order: labels of the ranked methods, best first.
    tied:  those whose difference from the best is not significant.
    cases: common cases, of ``clips`` source clips.
    p:     label -> p-value of the difference from the best, adjusted for all pairs of methods (Holm).
    left_out: label -> why a ranked method is not ranked by this value.
    """

    order: tuple[str, ...]
    tied: frozenset[str]
    cases: int
    clips: int
    p: Mapping[str, float]
    left_out: Mapping[str, str]

    @property
    def best(self) -> str:
        return self.order[0]

    @property
    def pairs(self) -> int:
        """Pairs of ranked methods, for which p-values are adjusted."""
        return len(self.order) * (len(self.order) - 1) // 2

    @property
    def separable(self) -> bool:
        """True if so many clips could have told the best from the worst."""
        return len(self.order) > 1 and statistics.could_separate(self.clips, self.pairs)


@dataclass
class MethodSummary:
    """One method on one split.

    means:  value id -> Mean; a value that no case has is absent. Of ranked methods over the common cases,
            of controls and methods with privileged inputs over those of them that they have.
    curves: value id -> index -> Mean.
    spread: value id -> standard deviation over seeds of the mean; empty where there is one seed.
    fps:    frames per second of one process and thread, handing over included; None: not measured.
    pace:   seconds of ``timing.yardstick`` at that moment; nan where it is not known.
    sets:   values of all answers as a set, by target structure; under several seeds, those of the first.
    """

    label: str
    header: ResultHeader
    means: Mapping[str, Mean]
    curves: Mapping[str, Mapping[str, Mean]]
    fps: float | None
    spread: Mapping[str, float] = field(default_factory=dict)
    sets: list[set_metrics.SetValue] = field(default_factory=list)
    pace: float = math.nan

    @property
    def asked(self) -> int:
        return self.header.counts.asked

    @property
    def ok(self) -> int:
        return self.header.counts.ok

    @property
    def unranked(self) -> str:
        """The reason why the method is not ranked; "" where it is."""
        return unranked(self.header)


@dataclass
class SplitSummary:
    """All methods on one split of one data set, or on one part of it.

    meaning:  what the cases of the split have in common; "" where results do not say it.
    part:     which group of the cases, or joints, this is; "" for all.
    bodies:   the group of bodies that it is of, see ``selection.BODIES``; "" where they are not told apart.
    rankings: value id -> Ranking; values that are descriptions, or curves, have none.
    so_far:   see ``ResultMatrix``.
    variants: labels of variants of methods that were left out.
    matrix:   what it was made of.
    """

    dataset: str
    split: str
    notes: list[str]
    scores: list[MethodSummary]
    pairs: int
    clips: int
    frames: int
    values: dict[str, DeclaredValue] = field(default_factory=dict)
    rankings: Mapping[str, Ranking] = field(default_factory=dict)
    meaning: str = ""
    part: str = ""
    bodies: str = ""
    so_far: str = ""
    variants: tuple[str, ...] = ()
    matrix: ResultMatrix | None = field(default=None, repr=False)

    def slower(self, score: MethodSummary) -> str:
        """Why the speed of a method is not to be compared with those of the others; "" where it is."""
        paces = [each.pace for each in self.scores if each.fps is not None and each.pace > 0]
        if not paces or not score.pace > timing.SLOWER * min(paces):
            return ""
        return (
            f"timed when the machine was {score.pace / min(paces):.1f} times as slow as for the fastest; "
            "bench run times it again when all is quiet"
        )

    def on_cases_of(self, label: str, other: str, values: Iterable[str]) -> dict[str, tuple[Mean, Mean]]:
        """Id of these values -> means of two methods over the cases that both have a number for."""
        if self.matrix is None:
            return {}
        labels = [row.label for row in self.matrix.rows]
        if not {label, other} <= set(labels):
            return {}
        at = [labels.index(label), labels.index(other)]
        found = {}
        for value in values:
            numbers = self.matrix.numbers((value, ""))[at]
            numbers[:, np.isnan(numbers).any(axis=0)] = np.nan
            one, two = means_over_clips(numbers, self.matrix.clips)
            if one is not None and two is not None:
                found[value] = one, two
        return found


def never_ranked(method: MethodInfo) -> str:
    """The reason why a method is never ranked (a control, privileged inputs); "" where it may be."""
    seen = ", ".join(name.replace("_", " ") for name in method.privileged)
    return "control" if method.control else f"sees {seen}" if seen else ""


def unranked(header: ResultHeader) -> str:
    """The reason why a method with this header is not ranked; "" where it is.

    Whoever leaves out a case would choose the cases that all are compared on, so it is compared apart.
    """
    counts = header.counts
    fewer = f"answered {counts.ok} of {counts.asked}" if counts.ok < counts.asked else ""
    return never_ranked(header.method) or fewer


def split_summaries(
    places: Iterable[ResultPaths],
    by: By | None = None,
    at_least: int | None = None,
    *,
    select: Selection | None = None,
    metres: bool = False,
) -> list[SplitSummary]:
    """The results at these places, by data set and split, in the order of the data set.

    by: one section per group: ``pair``, ``clip``, ``kind``, ``joint``, ``part`` (of the body), ``seen``
        (characters and motion seen in the training of the method, or else of the data set), or per
        point of curves over it: ``second``, ``threshold``.
    at_least: only of the cases that last so many seconds.
    select: only some methods; one section per group of bodies.
    metres: values in per cent of the height in metres, see ``results.metres``.
    Numbers on other data, or of another version of a metric, than the newest of a data set are left out.
    Raises BenchError where results lack the metadata of the breakdown, heights, or the durations of cases.
    """
    found = [in_metres(matrix) if metres else matrix for matrix in result_matrices(places)]
    if at_least is not None:
        found = [matrix for matrix in (lasting(each, at_least) for each in found) if len(matrix.cases)]
        if not found:
            raise BenchError(f"no case lasts {at_least} s and has a reference; ask for less")
    found = found if select is None else select.parts(found)
    parts = found if by is None else [part for matrix in found for part in breakdown(matrix, by)]
    return [split_summary(part) for part in parts]


def split_summary(matrix: ResultMatrix) -> SplitSummary:
    """Means, curves and rankings of all methods of a matrix."""
    own = [info for info, own in zip(matrix.cases, matrix.own, strict=True) if own]
    clips = {info.clip for info in own} if matrix.bodies else None
    section = _Section(matrix)
    for score, row in zip(section.scores, matrix.rows, strict=True):
        times = timing.read(row.paths, clips)
        score.fps, score.pace = timing.rate(times), timing.pace(times)
        score.sets = [] if matrix.part or matrix.so_far else _sets(matrix, row)
    return SplitSummary(
        dataset=matrix.dataset,
        split=matrix.split,
        notes=list(matrix.rows[0].header.dataset.notes),
        scores=section.scores,
        pairs=len({(info.source, info.target) for info in own}),
        clips=len({info.clip for info in own}),
        frames=sum(info.frames for info in own),
        values=dict(matrix.values),
        rankings=section.rankings,
        meaning=matrix.meaning,
        part=matrix.part,
        bodies=matrix.bodies,
        so_far=matrix.so_far,
        variants=matrix.variants,
        matrix=matrix,
    )


class _Section:
    """The summaries of all methods of a matrix, and their rankings, computed value by value on demand."""

    def __init__(self, matrix: ResultMatrix) -> None:
        self.matrix = matrix
        self.waiting: dict[str, list[str]] = {}
        for value, index in matrix.keys:
            self.waiting.setdefault(value, []).append(index)
        ids = tuple(self.waiting)
        self.rankings: OnDemand[Ranking] = OnDemand(ids, self.compute)
        self.means: list[OnDemand[Mean]] = [OnDemand(ids, self.compute) for _ in matrix.rows]
        self.curves: list[OnDemand[dict[str, Mean]]] = [OnDemand(ids, self.compute) for _ in matrix.rows]
        self.spreads: list[OnDemand[float]] = [OnDemand(ids, self.compute) for _ in matrix.rows]
        self.scores = [
            MethodSummary(row.label, row.header, self.means[i], self.curves[i], None, self.spreads[i])
            for i, row in enumerate(matrix.rows)
        ]
        self.ranked = np.array([not score.unranked for score in self.scores])
        self.never = np.array([bool(never_ranked(row.header.method)) for row in matrix.rows])

    def compute(self, value: str) -> None:
        """All that is known of a value."""
        for index in self.waiting.pop(value, ()):
            numbers = self.matrix.numbers((value, index))
            common, among, left_out = common_cases(numbers, self.ranked)
            alike = among | self.never if among.any() else among
            numbers[alike] = np.where(common, numbers[alike], np.nan)
            for row, mean in enumerate(means_over_clips(numbers, self.matrix.clips)):
                if mean is not None and index:
                    self.curves[row].found.setdefault(value, {})[index] = mean
                elif mean is not None:
                    self.means[row].found[value] = mean
            if index:
                continue
            for row, each in enumerate(among):
                self._add_spread(row, value, common if each else None)
            if self.matrix.values[value].better != "none" and among.any():
                self.rankings.found[value] = _ranking(self.matrix, value, numbers, among, left_out)

    def _add_spread(self, row: int, value: str, common: np.ndarray | None) -> None:
        """The spread over seeds, of a method that ran with several: of the mean over the same cases."""
        runs = self.matrix.rows[row].runs
        if value in self.means[row].found and len(runs) > 1:
            draws = np.array([draw[value, ""] for draw in runs])
            there = ~np.isnan(draws).any(axis=0) & (True if common is None else common)
            means = statistics.per_clip(draws[:, there], self.matrix.clips[there]).mean(axis=1)
            self.spreads[row].found[value] = float(means.std(ddof=1))


def common_cases(numbers: np.ndarray, ranked: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[int, str]]:
    """``(cases,)`` bool: cases that all ranked methods have a number for; ``(methods,)`` bool: those whose
    means are over these; and why ranked methods are left out.

    numbers: ``(methods, cases)``; ranked: ``(methods,)`` bool. Not every answer has every number: a method
    that has it for less than ``COVERAGE`` of the cases that any ranked method has it for is left out, lest
    it shrink the set.
    """
    there = ~np.isnan(numbers)
    any_of = there[ranked].any(axis=0)
    counts = there.sum(axis=1)
    few = ranked & (counts < COVERAGE * any_of.sum())
    left_out = {int(i): f"has it for {counts[i]} of {any_of.sum()} cases" for i in np.flatnonzero(few)}
    common = any_of & there[ranked & ~few].all(axis=0)
    return common, ranked & ~few & common.any(), left_out


def means_over_clips(numbers: np.ndarray, clips: np.ndarray) -> list[Mean | None]:
    """The mean over clips of every row of ``(methods, cases)``; None where a row has no number."""
    per_clip = statistics.per_clip(numbers, clips)
    counts, filled = (~np.isnan(numbers)).sum(axis=1), (~np.isnan(per_clip)).sum(axis=1)
    totals = np.nansum(per_clip, axis=1)
    found = statistics.mean_intervals(per_clip)
    return [
        Mean(float(total / k), int(n), int(k), interval) if n else None
        for total, n, k, interval in zip(totals, counts, filled, found, strict=True)
    ]


def _ranking(
    matrix: ResultMatrix, value: str, numbers: np.ndarray, among: np.ndarray, left_out: Mapping[int, str]
) -> Ranking:
    labels = [row.label for row in matrix.rows]
    # by name, so that equals stand in one order however the results were listed
    at = np.array(sorted(np.flatnonzero(among), key=lambda row: labels[row]))
    cases, per_clip = _losses(matrix, value, numbers[at])
    order = np.argsort(per_clip.mean(axis=1), kind="stable")
    best, p = statistics.against_best(per_clip, matrix.values[value].tolerance)
    adjusted = {labels[at[i]]: float(p[i]) for i in order if i != best}
    return Ranking(
        order=tuple(labels[at[i]] for i in order),
        tied=frozenset(label for label, each in adjusted.items() if each >= statistics.ALPHA),
        cases=cases,
        clips=per_clip.shape[1],
        p=adjusted,
        left_out={labels[i]: why for i, why in left_out.items()},
    )


def _losses(matrix: ResultMatrix, value: str, numbers: np.ndarray) -> tuple[int, np.ndarray]:
    """Number of cases that all rows of ``(methods, cases)`` have; ``(methods, clips)`` means of losses."""
    declared = matrix.values[value]
    worse = statistics.losses(numbers, declared.better, declared.goal)
    there = ~np.isnan(worse).any(axis=0)
    return int(there.sum()), statistics.per_clip(worse[:, there], matrix.clips[there])


def _sets(matrix: ResultMatrix, row: MethodRow) -> list[set_metrics.SetValue]:
    """Values of sets, where bodies are told apart those of structures that the cases' targets have.

    A value that the header does not declare is left from earlier results that had other metrics, and all
    are where results are not complete.
    """
    stored = set_metrics.read(row.paths) if row.paths.complete else []
    found = [each for each in stored if each.value_id in row.header.set_values]
    structures = case_metadata.read_structures(row.paths) if matrix.bodies and found else None
    if structures is None:
        return found
    here = {structures.get(target, "") for target in matrix.targets}
    here |= {TWO_LEGS} if matrix.bodies == PEOPLE else set()
    return [each for each in found if each.structure in here]


# groups of ties
def separated(matrix: ResultMatrix, ranking: Ranking, value: str) -> np.ndarray:
    """``(methods, methods)`` bool, symmetric, in the order of the ranking: significant differences.

    Every method is compared with those below it as the best is in the table: sign flips over the same
    clips, adjusted by Holm with all pairs of methods as the family. That rejects no more than Holm over all
    pairs at once, and its first row is the table's.
    """
    labels = [row.label for row in matrix.rows]
    numbers = matrix.numbers((value, ""))[[labels.index(label) for label in ranking.order]]
    _, means = _losses(matrix, value, numbers)
    count = len(means)
    pairs = count * (count - 1) // 2
    apart = np.zeros((count, count), dtype=bool)
    for row in range(count - 1):
        differences = statistics.differences(means[row + 1 :], means[row], matrix.values[value].tolerance)
        p = statistics.holm(statistics.sign_flip(differences, pairs), pairs)
        apart[row, row + 1 :] = p < statistics.ALPHA
    found: np.ndarray = apart | apart.T
    return found


def tie_groups(apart: np.ndarray) -> list[tuple[int, ...]]:
    """All maximal groups without a significant difference inside; groups of one are left out.

    apart: ``(n, n)`` bool, symmetric. Piepho's (2004) insert and absorb: begin with one group of all, and
    split every group that holds a significantly different pair.
    """
    groups = [frozenset(range(len(apart)))]
    for first, second in np.argwhere(np.triu(apart)).tolist():
        split = [
            part
            for group in groups
            for part in ((group - {first}, group - {second}) if {first, second} <= group else (group,))
        ]
        unique = list(dict.fromkeys(split))
        groups = [group for group in unique if not any(group < other for other in unique)]
    return sorted(tuple(sorted(group)) for group in groups if len(group) > 1)
