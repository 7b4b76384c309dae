"""What a worker process does with a case or a batch: predict with every method that lacks it, and score."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from retarget_bench.api import Case, CaseInfo, Prediction
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import predict as stage_one
from retarget_bench.evaluation.plan import Plan, dataset, known_as, method, metrics, set_metrics
from retarget_bench.evaluation.predict import Invalid, Outcome
from retarget_bench.evaluation.score import score
from retarget_bench.evaluation.set_metrics import files as set_files
from retarget_bench.evaluation.set_metrics.collect import collect
from retarget_bench.evaluation.set_metrics.real import offers
from retarget_bench.files import write_text
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.store import CaseResult, ResultPaths

MISSING = Outcome("missing", "no prediction of this version is there; run bench predict, or bench run")


class CannotStore(BenchError):
    """The disk is full, or a folder of results cannot be written to."""


@dataclass(frozen=True)
class Stop:
    """What a worker answers when nobody's prediction can be kept: the run must end and say why."""

    reason: str


def work(job: dict[str, Any]) -> list[tuple[ResultPaths, CaseResult]] | Stop:
    """One job of ``run._jobs``: an entry per method and case that it lacks."""
    plan: Plan = job["plan"]
    know(plan.plugin_files)
    cases, lost = _loaded(job["dataset"], plan.task, job["split"], job["cases"])
    real = offers(dataset(job["dataset"], plan.task))
    found = [
        (place, CaseResult(case, "failed", lost[case]))
        for _, place, wanted in job["cells"]
        for case in wanted
        if case in lost
    ]
    try:
        for spec, place, keys in job["cells"]:
            outcomes = _outcomes(plan, job["dataset"], spec, place, keys, cases)
            found += [(place, _entry(plan, place, cases[case], outcomes[case], real)) for case in outcomes]
    except CannotStore as error:
        return Stop(str(error))
    return found


def _loaded(
    data: Spec, task: str, split: str, ids: Sequence[str]
) -> tuple[dict[str, Case], dict[str, str]]:
    """The cases that can be loaded, and why the others cannot."""
    cases: dict[str, Case] = {}
    lost: dict[str, str] = {}
    for each in ids:
        try:
            cases[each] = dataset(data, task).load(_infos(data, task, split)[each])
        except BenchError as error:
            lost[each] = str(error)
    return cases, lost


def _entry(plan: Plan, place: ResultPaths, case: Case, outcome: Outcome, real: bool) -> CaseResult:
    if outcome.prediction is None or plan.stage == "predict":
        return CaseResult(case.info.id, outcome.status, outcome.message)
    scored = stage_one.as_scored(outcome.prediction)
    _keep_features(plan, place, case, scored, real)
    return CaseResult(case.info.id, "ok", values=score(metrics(plan.metrics), case, scored))


def _keep_features(plan: Plan, place: ResultPaths, case: Case, scored: Prediction, real: bool) -> None:
    """What set metrics need of the case, for when the cell is complete. Raises CannotStore."""
    if asked := set_metrics(plan.metrics):
        arrays = collect(asked, case, scored, real)
        try:
            set_files.put(place, case.info.id, arrays)
        except FileError as error:
            raise CannotStore(str(error)) from error


def _outcomes(
    plan: Plan,
    data: Spec,
    spec: Spec,
    place: ResultPaths,
    keys: Mapping[str, str],
    cases: Mapping[str, Case],
) -> dict[str, Outcome]:
    """What came of every case that has a key: a prediction that is there, or a new one, which is then
    stored. All ``cases`` are asked where any is new."""
    found = {case: _kept(plan, place, keys[case], cases[case]) for case in keys if case in cases}
    new = [case for case, outcome in found.items() if outcome is None]
    made = _predicted(plan, data, spec, cases) if new else {}
    for case in new:
        _store(place, keys[case], cases[case], made[case])
    return {case: outcome or made[case] for case, outcome in found.items()}


def _kept(plan: Plan, place: ResultPaths, key: str, case: Case) -> Outcome | None:
    """What need not be asked, or must not; None where the method is to be asked."""
    if plan.external is not None:
        return elsewhere(plan.external, case)
    stored = None if plan.redo == "always" else _stored(place, key, case)
    retry = plan.redo == "failed" and stored is not None and stored.status in ("failed", "invalid")
    if stored is not None and not retry:
        return stored
    return MISSING if plan.stage == "score" else None


def _predicted(plan: Plan, data: Spec, spec: Spec, cases: Mapping[str, Case]) -> dict[str, Outcome]:
    # post-processes follow the very answers that the method gives alone
    asked, source, name = method(spec), dataset(data, plan.task), str(known_as(spec).alone)
    contexts = [
        stage_one.context_for(asked, source, case, store.case_seed(plan.seed, name, case.info.id))
        for case in cases.values()
    ]
    return dict(zip(cases, stage_one.predict_all(asked, list(cases.values()), contexts), strict=True))


# ------------------------------------------------------------------------------------- stored outcomes
def _store(place: ResultPaths, key: str, case: Case, outcome: Outcome) -> None:
    """A prediction as ``.npz``, a refusal or failure as ``.json``; never both. Raises CannotStore."""
    path = place.prediction(case.info.id)
    note = path.with_suffix(".json")
    facts = {"key": key, "status": outcome.status, "message": outcome.message}
    try:
        if outcome.prediction is not None:
            stage_one.write_prediction(path, outcome.prediction, key)
            note.unlink(missing_ok=True)
        else:
            write_text(note, json.dumps(facts, ensure_ascii=False) + "\n")
            path.unlink(missing_ok=True)
    except FileError as error:
        raise CannotStore(str(error)) from error
    except OSError as error:
        raise CannotStore(f"{path}: cannot be replaced ({error.strerror})") from error


def _stored(place: ResultPaths, key: str, case: Case) -> Outcome | None:
    """The outcome that an earlier run stored under this key, or None."""
    path = place.prediction(case.info.id)
    if path.exists():
        if stage_one.stored_key(path) != key:
            return None
        return _checked(path, case)
    try:
        facts = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        return Outcome(facts["status"], facts["message"]) if facts["key"] == key else None
    except (OSError, ValueError, KeyError):
        return None


def elsewhere(folder: Path, case: Case) -> Outcome:
    """A prediction made by somebody else, found by the case's file name."""
    stem = store.case_file(case.info.id)
    found = [path for suffix in (".npz", ".bvh") if (path := folder / (stem + suffix)).exists()]
    if len(found) == 2:
        return Outcome("invalid", f"{folder} has both {stem}.npz and {stem}.bvh; remove one")
    return _checked(found[0], case) if found else Outcome("missing", f"{folder} has no {stem}.npz or .bvh")


def _checked(path: Path, case: Case) -> Outcome:
    try:
        found: Prediction = stage_one.read_prediction(path, case.target, case.source.fps)
        return Outcome("ok", prediction=stage_one.verified(found, case))
    except (Invalid, FileError) as error:
        return Outcome("invalid", str(error))


# ---------------------------------------------------------------------------------- process-wide state
@cache
def know(files: Sequence[str]) -> None:
    """Register the plug-in files that the run was started with."""
    for file in files:
        registry.add_file(file)


@lru_cache(maxsize=8)
def _infos(data: Spec, task: str, split: str) -> dict[str, CaseInfo]:
    listed = dataset(data, task).cases(Spec.parse(task).name, split)
    return {info.id: info for info in listed}
