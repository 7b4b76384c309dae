"""Means and rankings: values averaged per source clip, then over clips, by method and split."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache, cached_property
from itertools import compress
from typing import TypeVar

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.breakdown import By, breakdown, lasting
from retarget_bench.analysis.ranking import (
    Ranking,
    common_cases,
    never_ranked,
    ranking,
    set_ranking,
    unranked,
)
from retarget_bench.analysis.selection import PEOPLE, Selection
from retarget_bench.analysis.statistics import Interval
from retarget_bench.api import TWO_LEGS, CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import set_metrics, timing
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import case_metadata
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.results.metres import in_metres
from retarget_bench.results.result_matrix import MethodRow, ResultMatrix, result_matrices, set_values
from retarget_bench.results.store import ResultPaths

T = TypeVar("T")
PEOPLE_SET = (TWO_LEGS, "")
"""The set of all bodies of a table of people: target structure and kind."""


class OnDemand(Mapping[str, T]):
    """A mapping by value id that is computed on access: of a million cases tables show few values.

    compute: value id -> its entry, or None; it remembers.
    """

    def __init__(self, ids: Iterable[str], compute: Callable[[str], T | None]) -> None:
        self.ids, self.compute = dict.fromkeys(ids), compute

    def __getitem__(self, value: str) -> T:
        result = self.compute(value) if value in self.ids else None
        if result is None:
            raise KeyError(value)
        return result

    def __iter__(self) -> Iterator[str]:
        return (value for value in self.ids if value in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __bool__(self) -> bool:
        return any(True for _ in self)


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
    sets: list[SetValue] = field(default_factory=list)
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


@dataclass(frozen=True, eq=False)
class SplitSummary(ResultMatrix):
    """The results of all methods on one split of one data set, or on one part of it, with their means.

    scores:   of the rows, in their order.
    rankings: value id -> Ranking; values that are descriptions, or curves, have none, and of values of
              sets only those of all people.
    """

    scores: tuple[MethodSummary, ...] = ()
    rankings: Mapping[str, Ranking] = field(default_factory=dict)

    @cached_property
    def infos(self) -> list[CaseInfo]:
        """The cases of the split itself, without self pairs that some values pool."""
        return list(compress(self.cases, self.own.tolist()))

    @property
    def clip_count(self) -> int:
        """Number of source clips."""
        return len({info.clip for info in self.infos})

    @property
    def pair_count(self) -> int:
        """Number of pairs of source and target."""
        return len({(info.source, info.target) for info in self.infos})

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
        labels = [row.label for row in self.rows]
        if not {label, other} <= set(labels):
            return {}
        at = [labels.index(label), labels.index(other)]
        means_of = {}
        for value in values:
            numbers = self.numbers((value, ""))[at]
            numbers[:, np.isnan(numbers).any(axis=0)] = np.nan
            one, two = means_over_clips(numbers, self.clips)
            if one is not None and two is not None:
                means_of[value] = one, two
        return means_of


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
    matrices = [in_metres(matrix) if metres else matrix for matrix in result_matrices(places)]
    if at_least is not None:
        matrices = [
            matrix for matrix in (lasting(each, at_least) for each in matrices) if len(matrix.cases)
        ]
        if not matrices:
            raise BenchError(f"no case lasts {at_least} s and has a reference; ask for less")
    matrices = matrices if select is None else select.parts(matrices)
    parts = matrices if by is None else [part for matrix in matrices for part in breakdown(matrix, by)]
    return [split_summary(part) for part in parts]


def split_summary(matrix: ResultMatrix) -> SplitSummary:
    """Means, curves and rankings of all methods of a matrix."""
    clips = {info.clip for info in compress(matrix.cases, matrix.own.tolist())} if matrix.bodies else None
    of_value = cache(lambda value: _of_value(matrix, value))
    ids = dict.fromkeys(value for value, _ in matrix.keys)

    def of_row(row: int) -> MethodSummary:
        method = matrix.rows[row]
        times = timing.read(method.paths, clips)
        return MethodSummary(
            label=method.label,
            header=method.header,
            means=OnDemand(ids, lambda value: of_value(value).means[row]),
            curves=OnDemand(ids, lambda value: of_value(value).curves[row] or None),
            spread=OnDemand(ids, lambda value: of_value(value).spreads[row]),
            fps=timing.rate(times),
            pace=timing.pace(times),
            sets=stored_sets(matrix, method),
        )

    scores = tuple(of_row(row) for row in range(len(matrix.rows)))
    sets = set_values(row.header for row in matrix.rows)
    of_sets = cache(lambda value: _set_ranking(scores, value, sets[value]))
    of_cases = cache(lambda value: _ranking(matrix, value))
    return SplitSummary(
        **{each.name: getattr(matrix, each.name) for each in fields(ResultMatrix)},
        scores=scores,
        rankings=OnDemand(
            [*ids, *sets], lambda value: of_sets(value) if value in sets else of_cases(value)
        ),
    )


@dataclass(frozen=True)
class _OfValue:
    """Mean, curve and spread over seeds of every row by one value."""

    means: list[Mean | None]
    curves: list[dict[str, Mean]]
    spreads: list[float | None]


def _of_value(matrix: ResultMatrix, value: str) -> _OfValue:
    nothing = [None] * len(matrix.rows)
    result = _OfValue([*nothing], [{} for _ in nothing], [*nothing])
    for index in [index for key, index in matrix.keys if key == value]:
        numbers, common, among, _ = common_numbers(matrix, value, index)
        means = means_over_clips(numbers, matrix.clips)
        if not index:
            spreads = [
                _spread(row, value, matrix.clips, common if each else np.True_) if mean else None
                for row, mean, each in zip(matrix.rows, means, among, strict=True)
            ]
            result = _OfValue(means, result.curves, spreads)
        else:
            for curve, mean in zip(result.curves, means, strict=True):
                curve |= {} if mean is None else {index: mean}
    return result


def _ranking(matrix: ResultMatrix, value: str) -> Ranking | None:
    """The ranking by a value, whose tests take longer than all means; None of curves."""
    if (value, "") not in matrix.keys:
        return None
    numbers, _, among, left_out = common_numbers(matrix, value)
    return ranking(matrix, value, numbers, among, left_out)


def common_numbers(
    matrix: ResultMatrix, value: str, index: str = ""
) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[int, str]]:
    """``(methods, cases)`` numbers, of ranked methods, controls and methods that see more on the common
    cases alone; and what ``common_cases`` gives."""
    numbers = matrix.numbers((value, index))
    ranked = np.array([not unranked(row.header) for row in matrix.rows])
    never = np.array([bool(never_ranked(row.header.method)) for row in matrix.rows])
    return numbers, *common_cases(numbers, ranked, never)


def _spread(row: MethodRow, value: str, clips: np.ndarray, common: np.ndarray | np.bool_) -> float | None:
    """Standard deviation over seeds of the mean over the common cases; None where there is one seed."""
    if len(row.runs) < 2:
        return None
    draws = np.array([draw[value, ""] for draw in row.runs])
    there = ~np.isnan(draws).any(axis=0) & common
    return float(statistics.per_clip(draws[:, there], clips[there]).mean(axis=1).std(ddof=1))


def means_over_clips(numbers: np.ndarray, clips: np.ndarray) -> list[Mean | None]:
    """The mean over clips of every row of ``(methods, cases)``; None where a row has no number."""
    per_clip = statistics.per_clip(numbers, clips)
    counts, filled = (~np.isnan(numbers)).sum(axis=1), (~np.isnan(per_clip)).sum(axis=1)
    totals = np.nansum(per_clip, axis=1)
    intervals = statistics.mean_intervals(per_clip)
    return [
        Mean(float(total / k), int(n), int(k), interval) if n else None
        for total, n, k, interval in zip(totals, counts, filled, intervals, strict=True)
    ]


# ---------------------------------------------------------------------------------------- values of sets
def stored_sets(matrix: ResultMatrix, row: MethodRow) -> list[SetValue]:
    """Values of sets of a row; where bodies are told apart, of structures that the cases' targets have.

    A value that the header does not declare is left from earlier results that had other metrics. There are
    none of parts of the cases, nor where results are not complete.
    """
    if matrix.part or matrix.so_far or not row.paths.complete:
        return []
    values = [each for each in set_metrics.read(row.paths) if each.value_id in row.header.set_values]
    structures = case_metadata.read(row.paths).structures if matrix.bodies and values else {}
    if not structures:
        return values
    here = {structures.get(target, "") for target in matrix.targets}
    here |= {TWO_LEGS} if matrix.bodies == PEOPLE else set()
    return [each for each in values if each.structure in here]


def of_set(values: Iterable[SetValue], key: str, which: tuple[str, str] = PEOPLE_SET) -> SetValue | None:
    """The value of an id, target structure and kind; None where there is none."""
    return next(
        (each for each in values if (each.value_id, each.structure, each.kind) == (key, *which)), None
    )


def usual_value(scores: Iterable[MethodSummary], key: str, which: tuple[str, str] = PEOPLE_SET) -> SetValue:
    """A value over the real windows that most methods were compared with.

    which: target structure and kind. Methods that lack a case have other windows. An empty value where no
    method has any.
    """
    candidates = [of_set(score.sets, key, which) for score in scores]
    values = [each for each in candidates if each is not None and each.value is not None]
    if not values:
        return SetValue(key, which[0], 0, 0, kind=which[1])
    real = Counter(each.real for each in values).most_common(1)[0][0]
    return next(each for each in values if each.real == real)


def _set_ranking(scores: Sequence[MethodSummary], key: str, declared: DeclaredValue) -> Ranking | None:
    """The ranking by a value of the set of all people, of methods over the usual windows."""
    usual = usual_value(scores, key)
    values = {score.label: of_set(score.sets, key) for score in scores if not score.unranked}
    return set_ranking(
        {label: value for label, value in values.items() if value is not None and value.real == usual.real},
        declared,
    )
