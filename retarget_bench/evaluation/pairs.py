"""Values of cases that all clips of their pair of bodies decide together (``PairMetric``).

A metric's extract of a case waits until the unit is complete (``waiting.py``). Then values are computed
pair by pair, in the order of the cases' ids, so that none depends on the order of the work.
"""

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import cast

import numpy as np

from retarget_bench.api import AnyMetric, Case, CaseInfo, Metric, PairMetric, Prediction
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import waiting
from retarget_bench.evaluation.attempt import attempt
from retarget_bench.evaluation.score import (
    Before,
    Faults,
    Scored,
    ask_metric,
    checked,
    compared,
    fault_of,
    missing,
    nothing,
    seconds,
)
from retarget_bench.evaluation.waiting import Extract
from retarget_bench.files import write_text
from retarget_bench.results.store import CaseResult, ResultPaths, Values

VALUES = "values.json"


def collect(
    metrics: Sequence[PairMetric], case: Case, prediction: Prediction, before: Before = nothing
) -> tuple[dict[str, Extract], Faults]:
    """The extracts of a case by the metrics that apply to it, and the faults of those that failed.

    Raises BenchError where the case itself does not fit together.
    """
    comparison = compared(case, prediction)
    extracts: dict[str, Extract] = {}
    faults: Faults = {}
    for metric in metrics:
        if not _applies(metric, case, prediction):
            continue
        try:
            array = ask_metric(metric, partial(_extract, metric, comparison), comparison, before)
            extracts[metric.card.name] = Extract({}, [array])
        except BenchError as error:
            faults[metric.card.name] = fault_of(error)
    return extracts, faults


def _applies(metric: PairMetric, case: Case, prediction: Prediction) -> bool:
    return not any(missing(value, case, prediction) for value in metric.card.computed)


def _extract(metric: PairMetric, comparison: Comparison) -> np.ndarray:
    array = np.asarray(metric.extract(comparison), np.float32)
    if not np.isfinite(array).all():
        raise BenchError("keeps numbers that are not finite")
    return array


# ------------------------------------------------------------------------------------- of complete units
def write(
    metrics: Sequence[PairMetric], paths: ResultPaths, infos: Iterable[CaseInfo], before: Before = nothing
) -> None:
    """Compute the values of a unit whose cases are all answered, and write them beside what they are
    computed from. infos: of the answered cases. Raises FileError."""
    values: dict[str, Values] = {}
    faults: dict[str, Faults] = {}
    for clips in by_pair(infos).values():
        extracts = {info.id: waiting.read(waiting.file(paths, info.id)) for info in clips}
        scored = _of_pair(metrics, extracts, before)
        values |= {case: each.values for case, each in scored.items() if each.values}
        faults |= {case: each.faults for case, each in scored.items() if each.faults}
    write_text(_file(paths), json.dumps({"values": values, "faults": faults}))


def completed(paths: ResultPaths, entries: Iterable[CaseResult]) -> list[CaseResult]:
    """The entries of a unit with the values that ``write`` left. Raises FileError."""
    path = _file(paths)
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
        values, faults = stored["values"], stored["faults"]
    except (OSError, ValueError, KeyError) as error:
        raise FileError(path, f"{waiting.UNREADABLE} ({error})") from error
    return [
        replace(
            each,
            values={**each.values, **values.get(each.case, {})},
            faults={**each.faults, **faults.get(each.case, {})},
        )
        for each in entries
    ]


def _file(paths: ResultPaths) -> Path:
    return waiting.folder(paths) / VALUES


def by_pair(infos: Iterable[CaseInfo]) -> Mapping[str, list[CaseInfo]]:
    """Pair of bodies -> the cases of its clips, in the order in which values are computed of them."""
    pairs = defaultdict[str, list[CaseInfo]](list)
    for info in sorted(infos, key=lambda info: info.id):
        pairs[info.pair].append(info)
    return pairs


def _of_pair(
    metrics: Sequence[PairMetric], cases: Mapping[str, Mapping[str, Extract]], before: Before
) -> dict[str, Scored]:
    scored = {case: Scored() for case in cases}
    for metric in metrics:
        name = metric.card.name
        clips = {case: extracts[name].arrays[0] for case, extracts in cases.items() if name in extracts}
        if len(clips) < metric.least:
            continue
        try:
            before(name)
            for case, values in zip(clips, values_of(metric, list(clips.values())), strict=True):
                scored[case].values.update(values)
        except BenchError as error:
            for case in clips:
                scored[case].faults[name] = fault_of(error)
    return scored


def values_of(metric: PairMetric, clips: Sequence[np.ndarray]) -> list[Values]:
    """The values of each clip of a pair, from its extract. Raises BenchError where the metric fails
    or breaks its contract."""
    every = [value.id for value in metric.card.computed]

    def ask() -> list[Values]:
        answers = list(islice(metric.values(clips), len(clips) + 1))
        if len(answers) != len(clips):
            raise BenchError(f"gave values of {len(answers)} or more clips for {len(clips)}")
        return [checked(metric, answer, every) for answer in answers]

    limit = sum(seconds(clip.size) for clip in clips)
    return attempt(ask, limit, f"metric {metric.card.name}, pair")


# --------------------------------------------------------------------------------------- single cases
class OnePair(Metric):
    """A metric of pairs as one of cases: as if a case were all the clips of its pair."""

    def __init__(self, metric: PairMetric) -> None:
        self.card, self._metric = metric.card, metric

    def compute(self, comparison: Comparison) -> Mapping[str, float | Mapping[str, float]]:
        """The values of the case; none where one of them does not apply."""
        if not _applies(self._metric, comparison.case, comparison.prediction):
            return {}
        clips = [_extract(self._metric, comparison)] * self._metric.least
        return self._metric.values(clips)[0]


def of_case(metric: AnyMetric) -> Metric:
    """A metric of cases as it is; one of pairs as ``OnePair``."""
    return OnePair(metric) if isinstance(metric, PairMetric) else cast(Metric, metric)
