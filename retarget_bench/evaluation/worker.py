"""Jobs of the scoring processes: have a case or a batch predicted by every method that lacks it, and score.

They hold data sets and right answers, and import no method: each is asked in a process of its own
(``prediction/``).
"""

import atexit
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

from retarget_bench.api import Case, CaseInfo, Prediction, RealDataset
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import predict as stage_one
from retarget_bench.evaluation.plan import Plan, dataset, metrics, set_metrics
from retarget_bench.evaluation.predict import Inputs, Outcome
from retarget_bench.evaluation.prediction.limits import Limits
from retarget_bench.evaluation.prediction.workers import Crew, PredictionWorker
from retarget_bench.evaluation.score import score
from retarget_bench.evaluation.set_metrics import files as set_files
from retarget_bench.files import write_text
from retarget_bench.plugins import registry
from retarget_bench.plugins.prediction_check import Invalid, verified
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.store import CaseResult, ResultPaths

MISSING = Outcome("missing", "no prediction of this version is there; run bench predict, or bench run")


class CannotStore(BenchError):
    """The disk is full, or a folder of results cannot be written to."""


@dataclass(frozen=True)
class Stop:
    """The result of a job whose predictions cannot be stored: the run must end with this reason."""

    reason: str


@dataclass(frozen=True)
class JobPart:
    """A method and what it lacks of a job's cases.

    keys: case id -> key of its prediction. seeded_as: the name that its seeds are made from.
    inputs: what it is given beside source and target. lock: of the environment that it answers in, if that
    is another one.
    """

    method: Spec
    paths: ResultPaths
    keys: Mapping[str, str]
    seeded_as: str
    inputs: Inputs
    lock: str = ""


@dataclass(frozen=True)
class CaseJob:
    """Cases that are loaded once, and the methods that lack some of them.

    A method is given all ``cases`` at once, because how a batch is composed decides how results round.
    scratch: a folder for questions and answers. preload: modules that prediction workers begin with.
    """

    plan: Plan
    dataset: Spec
    split: str
    cases: tuple[str, ...]
    parts: tuple[JobPart, ...] = ()
    scratch: Path = Path()
    preload: tuple[str, ...] = ()


def work(job: CaseJob) -> list[tuple[ResultPaths, CaseResult]] | Stop:
    """Predict and score: a result per method and case that it lacks."""
    plan = job.plan
    register_plugins(plan.plugin_files)
    real = isinstance(dataset(job.dataset, plan.task), RealDataset)
    cases: dict[str, Case] = {}
    found: list[tuple[ResultPaths, CaseResult]] = []
    for each in job.cases:
        try:
            infos = _infos(job.dataset, plan.task, job.split)
            cases[each] = dataset(job.dataset, plan.task).load(infos[each])
        except BenchError as error:
            lost = CaseResult(each, "failed", str(error))
            found += [(part.paths, lost) for part in job.parts if each in part.keys]
    try:
        outcomes = [_outcomes(job, part, cases) for part in job.parts]
        for case in cases:  # all methods of one case in turn: metrics keep features of its reference
            found += [
                (part.paths, _entry(plan, part.paths, cases[case], mine[case], real))
                for part, mine in zip(job.parts, outcomes, strict=True)
                if case in mine
            ]
    except CannotStore as error:
        return Stop(str(error))
    return found


def _entry(plan: Plan, paths: ResultPaths, case: Case, outcome: Outcome, real: bool) -> CaseResult:
    """The scored case; its features for metrics of sets wait in a file until the unit is complete.

    Raises CannotStore.
    """
    if outcome.prediction is None or plan.stage == "predict":
        return CaseResult(case.info.id, outcome.status, outcome.message)
    scored = stage_one.as_scored(outcome.prediction)
    if asked := set_metrics(plan.metrics):
        arrays = set_files.collect(asked, case, scored, real)
        try:
            set_files.write_waiting(set_files.case_features(paths, case.info.id), arrays)
        except FileError as error:
            raise CannotStore(str(error)) from error
    return CaseResult(case.info.id, "ok", values=score(metrics(plan.metrics), case, scored))


def _outcomes(job: CaseJob, part: JobPart, cases: Mapping[str, Case]) -> dict[str, Outcome]:
    """The outcome of every case that has a key: from a stored prediction, or from a new one, which is then
    stored. The method is given all ``cases`` where any is new."""
    plan, paths = job.plan, part.paths
    found = {case: _kept(plan, paths, key, cases[case]) for case, key in part.keys.items() if case in cases}
    new = [case for case, outcome in found.items() if outcome is None]
    made = _predicted(job, part, cases) if new else {}
    for case in new:
        if made[case].status != "missing":
            _store(paths, part.keys[case], cases[case], made[case])
    return {case: outcome or made[case] for case, outcome in found.items()}


def _kept(plan: Plan, paths: ResultPaths, key: str, case: Case) -> Outcome | None:
    """The outcome where the method need not or must not be asked; None where it is to be."""
    if plan.external is not None:
        return elsewhere(plan.external, case)
    stored = None if plan.redo == "always" else _stored(paths, key, case)
    retry = plan.redo == "failed" and stored is not None and stored.status in ("failed", "invalid")
    if stored is not None and not retry:
        return stored
    return MISSING if plan.stage == "score" else None


def _predicted(job: CaseJob, part: JobPart, cases: Mapping[str, Case]) -> dict[str, Outcome]:
    data = dataset(job.dataset, job.plan.task)
    contexts = [
        stage_one.context_for(
            part.inputs, data, case, store.case_seed(job.plan.seed, part.seeded_as, case.info.id)
        )
        for case in cases.values()
    ]
    worker = prediction_worker(job.plan, part.method, job.scratch, job.preload)
    worker.log, worker.lock = part.paths.log, part.lock
    asked = list(zip(cases.values(), contexts, strict=True))
    try:
        return dict(zip(cases, worker.ask(asked), strict=True))
    except OSError as error:
        raise CannotStore(f"{job.scratch}: cannot be written ({error.strerror})") from error


# ------------------------------------------------------------------------------------- stored outcomes
def _store(paths: ResultPaths, key: str, case: Case, outcome: Outcome) -> None:
    """A prediction as ``.npz``, a refusal or failure as ``.json``; never both. Raises CannotStore."""
    path = paths.prediction(case.info.id)
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


def _stored(paths: ResultPaths, key: str, case: Case) -> Outcome | None:
    """The outcome that an earlier run stored under this key, or None."""
    path = paths.prediction(case.info.id)
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
        return Outcome("ok", prediction=verified(found, case))
    except (Invalid, FileError) as error:
        return Outcome("invalid", str(error))


# ---------------------------------------------------------------------------------- process-wide state
@cache
def register_plugins(files: Sequence[tuple[str, registry.Kind]]) -> None:
    """Make the plug-in files known that the run was started with."""
    registry.know_files(files)


_CREWS: dict[tuple[object, ...], Crew] = {}


def prediction_worker(plan: Plan, method: Spec, scratch: Path, preload: Sequence[str]) -> PredictionWorker:
    """The worker of a method, which this process keeps for all jobs of a run."""
    limits = Limits(plan.timeout, int(plan.memory * 2**30))
    key = (plan.plugin_files, limits, scratch)
    if key not in _CREWS:
        end_predictions()  # those of an earlier run
        _CREWS[key] = Crew(scratch / str(os.getpid()), plan.plugin_files, limits, preload)
    return _CREWS[key].worker(method)


def end_predictions() -> None:
    """End all prediction workers of this process."""
    while _CREWS:
        _CREWS.popitem()[1].close()


atexit.register(end_predictions)


@lru_cache(maxsize=8)
def _infos(data: Spec, task: str, split: str) -> dict[str, CaseInfo]:
    listed = dataset(data, task).cases(Spec.parse(task).name, split)
    return {info.id: info for info in listed}
