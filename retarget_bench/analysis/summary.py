"""Means and rankings: values averaged per source clip, then over clips, by method and split."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.breakdown import By, breakdown, lasting
from retarget_bench.analysis.on_demand import OnDemand
from retarget_bench.analysis.ranking import Ranking, common_cases, doubt, never_ranked, ranking, unranked
from retarget_bench.analysis.selection import PEOPLE, Selection
from retarget_bench.analysis.statistics import Interval
from retarget_bench.api import TWO_LEGS
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import set_metrics, timing
from retarget_bench.results import case_metadata
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.results.metres import in_metres
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix, result_matrices
from retarget_bench.results.store import ResultPaths


@dataclass(frozen=True)
class Mean:
    """A mean over clips. ``n`` counts cases, ``clips`` the source clips they come from.

    interval: 95 %, over clips; None below ``statistics.ENOUGH_CLIPS`` clips.
    """

    value: float
    n: int
    clips: int
    interval: Interval | None = None


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
            ranked = self.matrix.values[value].better != "none" and not doubt(self.matrix, value)
            if ranked and among.any():
                self.rankings.found[value] = ranking(self.matrix, value, numbers, among, left_out)

    def _add_spread(self, row: int, value: str, common: np.ndarray | None) -> None:
        """The spread over seeds, of a method that ran with several: of the mean over the same cases."""
        runs = self.matrix.rows[row].runs
        if value in self.means[row].found and len(runs) > 1:
            draws = np.array([draw[value, ""] for draw in runs])
            there = ~np.isnan(draws).any(axis=0) & (True if common is None else common)
            means = statistics.per_clip(draws[:, there], self.matrix.clips[there]).mean(axis=1)
            self.spreads[row].found[value] = float(means.std(ddof=1))


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


def _sets(matrix: ResultMatrix, row: MethodRow) -> list[set_metrics.SetValue]:
    """Values of sets, where bodies are told apart those of structures that the cases' targets have.

    A value that the header does not declare is left from earlier results that had other metrics, and all
    are where results are not complete.
    """
    stored = set_metrics.read(row.paths) if row.paths.complete else []
    found = [each for each in stored if each.value_id in row.header.set_values]
    structures = case_metadata.read(row.paths).structures if matrix.bodies and found else {}
    if not structures:
        return found
    here = {structures.get(target, "") for target in matrix.targets}
    here |= {TWO_LEGS} if matrix.bodies == PEOPLE else set()
    return [each for each in found if each.structure in here]
