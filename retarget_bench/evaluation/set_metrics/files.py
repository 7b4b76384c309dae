"""Features of finished cases, and their files: of single cases, and of a whole unit."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from retarget_bench.api import Case, CaseFeatures, Comparison, OwnSets, Prediction, SetMetric
from retarget_bench.errors import BenchError, FileError, NotSupported
from retarget_bench.evaluation.score import Before, Faults, asked, compared, fault_of, nothing
from retarget_bench.results.store import ResultPaths, case_file, read_npz, write_npz

Arrays = dict[str, np.ndarray]


def features_path(paths: ResultPaths) -> Path:
    return paths.folder / f"{paths.method}.features.npz"


def waiting_folder(paths: ResultPaths) -> Path:
    """The folder of the features of finished cases, until the unit is complete."""
    return paths.folder / f"{paths.method}.features"


# ----------------------------------------------------------------------------------------- single cases
NO_REFERENCE = "needs reference motions, and this data set has none"
PARTS = ("generated", "real", "speed")
FACTS = ("set", "network", "reason")


def collect(
    metrics: Sequence[SetMetric],
    case: Case,
    prediction: Prediction,
    elsewhere: bool = False,
    before: Before = nothing,
) -> tuple[Arrays, Faults]:
    """Features of one case for the set metrics, as arrays ``<metric>:<name>``; ``<metric>:set`` names the
    set that it belongs to. None of a metric in none of whose sets it is. And what metrics did wrong.

    elsewhere: whether the data set has real motion to compare answers without a reference with.
    Raises BenchError where the case itself does not fit together.
    """
    comparison = compared(case, prediction)
    arrays: Arrays = {}
    faults: Faults = {}
    for metric in metrics:
        name = metric.card.name
        try:
            ask = partial(_collected, metric, comparison, elsewhere)
            found = asked(metric, ask, comparison, before)
        except BenchError as error:
            faults[name] = fault_of(error)
            reason = np.array(failed(name, faults[name]))
            found = {"set": np.array(case.target.structure), "reason": reason}
        arrays |= {f"{name}:{part}": array for part, array in found.items()}
    return arrays, faults


def failed(metric: str, fault: str) -> str:
    """The reason why there is no value of a metric that did something wrong."""
    return f"metric {metric} failed: {fault}"


def _collected(metric: SetMetric, comparison: Comparison, elsewhere: bool) -> Arrays:
    """Raises BenchError where the metric breaks its contract."""
    case = comparison.case
    belongs = metric.set_of(case) if isinstance(metric, OwnSets) else case.target.structure
    if not belongs:
        return {}
    arrays = {"set": np.array(str(belongs))}
    try:
        if case.reference is None and not elsewhere:
            raise NotSupported(NO_REFERENCE)
        arrays["network"] = np.array(str(metric.network(case.target)))
        found = metric.features(comparison)
    except NotSupported as reason:
        return {**arrays, "reason": np.array(str(reason))}
    parts = {part: np.asarray(getattr(found, part), np.float32) for part in PARTS}
    _check(parts, paired=case.reference is not None)
    return arrays | parts


def _check(parts: Arrays, paired: bool) -> None:
    generated, real, speed = (parts[part].shape for part in PARTS)
    if (paired and generated != real) or speed != generated[:1] or len(generated) != 2:
        raise BenchError(
            f"gave features {generated}, {real} and {speed}; they must be (windows, d), (windows, d) and "
            "(windows,)"
        )
    if not all(np.isfinite(each).all() for each in parts.values()):
        raise BenchError("gave features that are not finite")


def case_features(paths: ResultPaths, case_id: str) -> Path:
    """The file of the features of a finished case, until the unit is complete."""
    return waiting_folder(paths) / f"{case_file(case_id)}.npz"


def write_waiting(path: Path, arrays: Arrays) -> None:
    """What ``collect`` found for a case, as two arrays: with a dozen small ones, the archive would take
    longer than the features. Raises FileError."""
    facts = {name: list(a.shape) if a.dtype == np.float32 else str(a) for name, a in arrays.items()}
    numbers = [a.ravel() for a in arrays.values() if a.dtype == np.float32]
    joined = np.concatenate(numbers) if numbers else np.zeros(0, np.float32)
    write_npz(path, {"facts": np.array(json.dumps(facts)), "numbers": joined})


def _read_waiting(path: Path) -> Arrays:
    problem = "cannot be read; score it anew with --overwrite always"
    stored = read_npz(path, problem)
    try:
        left, found = stored["numbers"], {}
        for name, fact in json.loads(str(stored["facts"])).items():
            if isinstance(fact, str):
                found[name] = np.array(fact)
                continue
            found[name], left = left[: math.prod(fact)].reshape(fact), left[math.prod(fact) :]
    except (KeyError, ValueError, TypeError) as error:
        raise FileError(path, f"{problem} ({error})") from error
    return found


def gather(paths: ResultPaths, cases: Iterable[str]) -> Arrays:
    """The features of these cases as arrays ``<case>/<name>``; those of all cases are written beside the
    rows."""
    waiting = {case: _read_waiting(case_features(paths, case)) for case in sorted(cases)}
    _leave_out(waiting)
    write_npz(features_path(paths), _joined(waiting))
    return {f"{case}/{name}": array for case, mine in waiting.items() for name, array in mine.items()}


def _metrics(waiting: Mapping[str, Arrays]) -> list[str]:
    return sorted({name.partition(":")[0] for mine in waiting.values() for name in mine})


def _leave_out(waiting: Mapping[str, Arrays]) -> None:
    """Put a reason in place of features that do not fit together."""
    for metric in _metrics(waiting):
        names = [f"{metric}:{part}" for part in PARTS]
        found = (mine[name] for mine in waiting.values() for name in names[:2] if name in mine)
        widths = sorted({each.shape[1] for each in found if len(each)})
        if len(widths) > 1:
            reason = failed(metric, f"gave features of {' and '.join(map(str, widths))} numbers")
            for mine in waiting.values():
                if [mine.pop(name) for name in names if name in mine]:
                    mine[f"{metric}:reason"] = np.array(reason)


def _joined(waiting: Mapping[str, Arrays]) -> Arrays:
    """For each metric the cases that belong to some of its sets, a text of each for ``FACTS``, and the
    windows of all as one array for each of ``PARTS``, with how many are of which case."""
    joined: Arrays = {}
    for metric in _metrics(waiting):
        mine = {case: arrays for case, arrays in waiting.items() if f"{metric}:set" in arrays}
        joined[f"{metric}:case"] = np.array(list(mine))
        for fact in FACTS:
            texts = [str(arrays.get(f"{metric}:{fact}", "")) for arrays in mine.values()]
            joined[f"{metric}:{fact}"] = np.array(texts)
        for part in PARTS:
            pieces = [arrays.get(f"{metric}:{part}", np.zeros(0, np.float32)) for arrays in mine.values()]
            filled = [piece for piece in pieces if len(piece)] or pieces[:1]
            joined[f"{metric}:{part}"] = np.concatenate(filled)
            joined[f"{metric}:{part}_windows"] = np.array([len(piece) for piece in pieces])
    return joined


def stored_features(path: Path, metric: str) -> dict[str, CaseFeatures]:
    """Case -> its features for a metric, from the file of a finished unit. Raises FileError, and KeyError
    for a metric that it has none of."""
    stored = read_npz(path, "cannot be read; score the method again")
    parts = [
        np.split(stored[f"{metric}:{part}"], np.cumsum(stored[f"{metric}:{part}_windows"])[:-1])
        for part in PARTS
    ]
    cases = map(str, stored[f"{metric}:case"])
    return {case: CaseFeatures(*mine) for case, *mine in zip(cases, *parts, strict=True)}
