"""Features of single cases for set metrics, and the files that they wait in until a unit is complete."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from retarget_bench.api import Case, CaseFeatures, Comparison, OwnSets, Prediction, SetMetric
from retarget_bench.errors import BenchError, FileError, NotSupported
from retarget_bench.evaluation.score import Before, Faults, ask_metric, compared, fault_of, nothing
from retarget_bench.results.store import ResultPaths, case_file, read_npz, write_npz

NO_REFERENCE = "needs reference motions, and this data set has none"
UNREADABLE = "cannot be read; score it anew with --overwrite always"


@dataclass(frozen=True, eq=False)
class SetMember:
    """A case in one of the sets of a metric, by its features or by the reason why it has none.

    name: of the set: a target structure, where the metric has no sets of its own. network: hash of what
    makes the features.
    """

    name: str
    network: str = ""
    reason: str = ""
    features: CaseFeatures | None = None


Members = dict[str, SetMember]
"""Metric -> a case in its sets; without the metrics in none of whose sets it is."""


def waiting_folder(paths: ResultPaths) -> Path:
    """The folder of the features of finished cases, until the unit is complete."""
    return paths.folder / f"{paths.method}.features"


def waiting_file(paths: ResultPaths, case_id: str) -> Path:
    """The file of the features of a finished case, until the unit is complete."""
    return waiting_folder(paths) / f"{case_file(case_id)}.npz"


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
    case, network = comparison.case, ""
    belongs = metric.set_of(case) if isinstance(metric, OwnSets) else case.target.structure
    if not belongs:
        return None
    paired = case.reference is not None
    try:
        if not paired and not elsewhere:
            raise NotSupported(NO_REFERENCE)
        network = str(metric.network(case.target))
        answer = metric.features(comparison)
    except NotSupported as reason:
        return SetMember(str(belongs), network, str(reason))
    features = CaseFeatures(
        *(np.asarray(each, np.float32) for each in (answer.generated, answer.real, answer.speed))
    )
    _check(features, paired)
    return SetMember(str(belongs), network, features=features)


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
def write_waiting(path: Path, members: Members) -> None:
    """Write two arrays: with a dozen small ones, the archive would take longer than the features.
    Raises FileError."""
    arrays = {name: list(vars(each.features).values()) for name, each in members.items() if each.features}
    facts = {
        name: {**vars(each), "features": [array.shape for array in arrays.get(name, ())]}
        for name, each in members.items()
    }
    numbers = [array.ravel() for each in arrays.values() for array in each]
    joined = np.concatenate(numbers) if numbers else np.zeros(0, np.float32)
    write_npz(path, {"facts": np.array(json.dumps(facts)), "numbers": joined})


def _read_waiting(path: Path) -> Members:
    stored, members = read_npz(path, UNREADABLE), {}
    try:
        left = stored["numbers"]
        for metric, facts in json.loads(str(stored["facts"])).items():
            arrays = []
            for shape in facts.pop("features"):
                arrays.append(left[: math.prod(shape)].reshape(shape))
                left = left[math.prod(shape) :]
            members[metric] = SetMember(**facts, features=CaseFeatures(*arrays) if arrays else None)
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise FileError(path, f"{UNREADABLE} ({error})") from error
    return members


def gather(paths: ResultPaths, cases: Iterable[str]) -> Mapping[str, Members]:
    """Case -> its features, of the finished cases of a unit. Raises FileError."""
    return {case: _read_waiting(waiting_file(paths, case)) for case in sorted(cases)}
