"""Features of single cases for set metrics, which wait until a unit is complete."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from retarget_bench.api import Case, CaseFeatures, Comparison, Prediction, SetMetric
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.evaluation import waiting
from retarget_bench.evaluation.score import Before, Faults, ask_metric, compared, fault_of, nothing
from retarget_bench.evaluation.waiting import Extract
from retarget_bench.results.store import ResultPaths

NO_REFERENCE = "needs reference motions, and this data set has none"


@dataclass(frozen=True, eq=False)
class SetMember:
    """A case in one of the sets of a metric, by its features or by the reason why it has none.

    name: of the set: a target structure, where the metric has no sets of its own.
    """

    name: str
    reason: str = ""
    features: CaseFeatures | None = None


Members = dict[str, SetMember]
"""Metric -> a case in its sets; without the metrics in none of whose sets it is."""


# -------------------------------------------------------------------------------------------- features
def collect(
    metrics: Sequence[SetMetric],
    case: Case,
    prediction: Prediction,
    elsewhere: bool = False,
    before: Before = nothing,
) -> tuple[Members, Faults]:
    """The features of one case for the set metrics, and faults of metrics.

    elsewhere: whether the data set has real motion to compare answers without a reference with.
    Raises BenchError where the case itself does not fit together.
    """
    comparison = compared(case, prediction)
    members: Members = {}
    faults: Faults = {}
    for metric in metrics:
        name = metric.card.name
        try:
            ask = partial(_member, metric, comparison, elsewhere)
            if (member := ask_metric(metric, ask, comparison, before)) is not None:
                members[name] = member
        except BenchError as error:
            faults[name] = fault_of(error)
            members[name] = SetMember(case.target.structure, reason=failed(name, faults[name]))
    return members, faults


def failed(metric: str, fault: str) -> str:
    """The reason why there is no value of a metric that failed."""
    return f"metric {metric} failed: {fault}"


def _member(metric: SetMetric, comparison: Comparison, elsewhere: bool) -> SetMember | None:
    """Raises BenchError where the metric breaks its contract."""
    case = comparison.case
    belongs = metric.set_of(case)
    if not belongs:
        return None
    paired = case.reference is not None
    try:
        if not paired and not elsewhere:
            raise NotSupported(NO_REFERENCE)
        answer = metric.features(comparison)
    except NotSupported as reason:
        return SetMember(str(belongs), str(reason))
    features = CaseFeatures(
        *(np.asarray(each, np.float32) for each in (answer.generated, answer.real, answer.speed))
    )
    _check(features, paired)
    return SetMember(str(belongs), features=features)


def _check(features: CaseFeatures, paired: bool) -> None:
    generated, real, speed = (each.shape for each in vars(features).values())
    if (paired and generated != real) or speed != generated[:1] or len(generated) != 2:
        raise BenchError(
            f"gave features {generated}, {real} and {speed}; they must be (windows, d), (windows, d) and "
            "(windows,)"
        )
    if not all(np.isfinite(each).all() for each in vars(features).values()):
        raise BenchError("gave features that are not finite")


# ----------------------------------------------------------------------------------------------- files
def extracts_of(members: Members) -> dict[str, Extract]:
    """Members as they wait."""
    return {
        name: Extract(
            {**vars(each), "features": None}, list(vars(each.features).values()) if each.features else ()
        )
        for name, each in members.items()
    }


def gather(metrics: Sequence[SetMetric], paths: ResultPaths, cases: Iterable[str]) -> Mapping[str, Members]:
    """Case -> its features, of the finished cases of a unit. Raises FileError."""
    names = [metric.card.name for metric in metrics]
    gathered = {}
    for case in sorted(cases):
        extracts = waiting.read(waiting.file(paths, case))
        gathered[case] = {name: _member_of(extracts[name]) for name in names if name in extracts}
    return gathered


def _member_of(extract: Extract) -> SetMember:
    features = CaseFeatures(*extract.arrays) if extract.arrays else None
    return SetMember(**{**extract.facts, "features": features})
