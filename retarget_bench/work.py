"""What a worker process does with one case: predict with every method that lacks it, and score."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from retarget_bench import predict as stage_one
from retarget_bench import records, registry
from retarget_bench.api import Case, CaseInfo, Prediction
from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import write_text
from retarget_bench.plan import Plan, dataset, method, metrics, set_metrics
from retarget_bench.predict import Invalid, Outcome
from retarget_bench.records import Entry, Place
from retarget_bench.score import score
from retarget_bench.sets import files as set_files
from retarget_bench.sets.collect import collect
from retarget_bench.spec import Spec

MISSING = Outcome("missing", "no prediction of this version is there; run bench predict, or bench run")


class CannotStore(BenchError):
    """The disk is full, or a folder of results cannot be written to."""


@dataclass(frozen=True)
class Stop:
    """What a worker answers when nobody's prediction can be kept: the run must end and say why."""

    reason: str


def work(job: dict[str, Any]) -> list[tuple[Place, Entry]] | Stop:
    """One job of ``run._jobs``: an entry per method."""
    plan: Plan = job["plan"]
    know(plan.plugin_files)
    try:
        info = _infos(job["dataset"], plan.task, job["split"])[job["case"]]
        case = dataset(job["dataset"]).load(info)
    except BenchError as error:
        return [(place, Entry(job["case"], "failed", str(error))) for _, place, _ in job["cells"]]
    try:
        return [
            (place, _entry(plan, job["dataset"], spec, place, key, case))
            for spec, place, key in job["cells"]
        ]
    except CannotStore as error:
        return Stop(str(error))


def _entry(plan: Plan, data: Spec, spec: Spec, place: Place, key: str, case: Case) -> Entry:
    outcome = _outcome(plan, data, spec, place, key, case)
    if outcome.prediction is None or plan.stage == "predict":
        return Entry(case.info.id, outcome.status, outcome.message)
    scored = stage_one.as_scored(outcome.prediction)
    _keep_features(plan, place, case, scored)
    return Entry(case.info.id, "ok", values=score(metrics(plan.metrics), case, scored))


def _keep_features(plan: Plan, place: Place, case: Case, scored: Prediction) -> None:
    """What set metrics need of the case, for when the cell is complete. Raises CannotStore."""
    if asked := set_metrics(plan.metrics):
        arrays = collect(asked, case, scored)
        try:
            set_files.put(place, case.info.id, arrays)
        except FileError as error:
            raise CannotStore(str(error)) from error


def _outcome(plan: Plan, data: Spec, spec: Spec, place: Place, key: str, case: Case) -> Outcome:
    """A prediction that is there, or a new one, which is then stored."""
    if plan.external is not None:
        return elsewhere(plan.external, case)
    stored = None if plan.redo == "always" else _stored(place, key, case)
    retry = plan.redo == "failed" and stored is not None and stored.status in ("failed", "invalid")
    if stored is not None and not retry:
        return stored
    if plan.stage == "score":
        return MISSING
    outcome = _predicted(plan, data, spec, case)
    _store(place, key, case, outcome)
    return outcome


def _predicted(plan: Plan, data: Spec, spec: Spec, case: Case) -> Outcome:
    asked = method(spec)
    seed = records.case_seed(plan.seed, str(spec), case.info.id)
    return stage_one.predict(asked, case, stage_one.context_for(asked, dataset(data), case, seed))


# ------------------------------------------------------------------------------------- stored outcomes
def _store(place: Place, key: str, case: Case, outcome: Outcome) -> None:
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


def _stored(place: Place, key: str, case: Case) -> Outcome | None:
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
    stem = records.case_file(case.info.id)
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
    return {info.id: info for info in dataset(data).cases(task, split)}
