"""Carrying out shards in one process: cases are loaded, methods asked, answers stored and scored.

It holds data sets and right answers, and imports no method: each is asked in a process of its own
(``prediction/``).
"""

import json
import os
import platform
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

from retarget_bench.api import Case, CaseInfo, Dataset, Prediction
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import conventions, pairs, plan, set_metrics, timing, waiting
from retarget_bench.evaluation.attempt import sentence
from retarget_bench.evaluation.cases import loaded
from retarget_bench.evaluation.plan import data_of
from retarget_bench.evaluation.predict import Outcome, as_scored, context_for
from retarget_bench.evaluation.prediction.limits import Limits
from retarget_bench.evaluation.prediction.questions import Question
from retarget_bench.evaluation.prediction.workers import WorkerPool
from retarget_bench.evaluation.score import Faults, score
from retarget_bench.evaluation.set_metrics import files as set_files
from retarget_bench.evaluation.set_metrics.evaluate import evaluate
from retarget_bench.evaluation.shards import StoredPlan, Task, Unit, machine_facts
from retarget_bench.evaluation.waiting import Extract
from retarget_bench.files import write_text
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.bound import BoundDataset
from retarget_bench.plugins.prediction_check import Invalid, verified
from retarget_bench.results import predictions, store
from retarget_bench.results.store import CaseResult, ResultPaths

MISSING = Outcome("missing", "no prediction of this version is there; bench run makes it")

At = Callable[[Sequence[int], Sequence[str], str], None]
"""Called with units, cases of theirs and what is asked before they are worked on, so that whoever looks on
can tell what a process was at when it ended. What is asked: the method (""), the data set (``LOADING``),
all metrics in turn (``SCORING``), or one by its name."""
LOADING, SCORING = "load()", "score()"


def unwatched(units: Sequence[int], cases: Sequence[str], call: str) -> None:
    """A process without an observer."""
    del units, cases, call


class CannotStore(BenchError):
    """The disk is full, or a folder of results cannot be written to: the run must end."""


class ShardWork:
    """Carries out shards of a stored plan, one after the other; it is closed at the end.

    scratch: a folder for questions and answers, which the processes of a run share on a machine. before:
    the work of an earlier plan of the run, which is over; its workers go on. check: whether the plan may
    have been made by another machine. Raises BenchError where that one had other code or data.
    """

    def __init__(
        self,
        folder: Path,
        scratch: Path,
        at: At = unwatched,
        before: "ShardWork | None" = None,
        check: bool = False,
    ) -> None:
        self.folder, self.stored, self.at = folder, StoredPlan(folder), at
        self._again, self._left_out = False, dict[tuple[int | None, str | None, str], str]()
        self.plan = self.stored.plan
        registry.know_files(self.plan.plugin_files)
        self.metrics = bound.metrics(self.plan.metrics)
        self._dataset = cache(bound.dataset)  # specs of units are canonical: each is read once
        if check:
            self._check()
        limits = Limits(self.plan.timeout or 0.0, int((self.plan.memory or 0.0) * 2**30), self.plan.isolate)
        place = scratch / str(os.getpid())
        self.pool: WorkerPool = (
            before.pool if before else WorkerPool(place, scratch, self.plan.plugin_files, limits)
        )

    def close(self) -> None:
        """End all prediction workers."""
        self.pool.close()

    def _check(self) -> None:
        """Raises BenchError that names a difference to the machine that planned the run."""
        planned = self.stored.content.common
        methods = {unit.method for unit in self.stored.units}
        facts = machine_facts(self.plan, methods, self.plan.datasets)
        for name in sorted(planned.keys() | facts.keys()):
            if (here := facts.get(name, "none")) != (there := planned.get(name, "none")):
                raise BenchError(
                    f"{platform.node()} has {name} {here} where the run was planned with {there}; all "
                    "machines need the same versions, code and data"
                )

    # ------------------------------------------------------------------------------------- kinds of work
    def do(self, request: Mapping[str, Any]) -> None:
        """Carry out a request (``shard_process.py``). Raises BenchError.

        again: a process ended at it before. without: unit, case and metric, None: all, of what is not to
        be asked, and why.
        """
        self._again = request["again"]
        self._left_out = {(unit, case, metric): why for unit, case, metric, why in request["without"]}
        {"shard": self.carry_out, "sets": self.sets, "time": self.time}[request["kind"]](request["number"])

    def carry_out(self, number: int) -> None:
        """Compute what a shard lacks, and write every answer as it is finished.

        Interrupted at any moment, it is to be carried out again: what is written is not computed anew.
        Raises BenchError.
        """
        write = self.stored.writer(number)
        for task in self.stored.lacking(number):
            for unit, entry in self._entries(task):
                write(unit, entry)

    def sets(self, number: int) -> None:
        """Compute and write the values of a unit's pairs and sets, whose cases are all answered."""
        unit = self.stored.units[number]
        answered = frozenset(self.stored.content.answered[number])
        infos = [info for info in self._infos(unit).values() if info.id in answered]
        self.at((number,), (), SCORING)
        before = partial(self._before, number, "")
        if self.metrics.of_pairs:
            pairs.write(self.metrics.of_pairs, unit.paths, infos, before)
        set_metrics.write(unit.paths, evaluate(self.plan, unit.dataset, unit.paths, infos, before))

    def time(self, number: int) -> None:
        """Measure and write how long a unit's method takes."""
        unit = self.stored.units[number]
        self.at((number,), (), "")
        timing.write(unit.paths, self._times(unit))

    # -------------------------------------------------------------------------------------------- answers
    def _entries(self, task: Task) -> Iterator[tuple[int, CaseResult]]:
        units = self.stored.units
        first = units[next(iter(task.lacking))]
        data = self._data(first)
        cases: dict[str, Case] = {}
        in_batches = self.plan.stage != "score" and any(units[unit].in_batches for unit in task.lacking)
        for each in task.cases:
            asking = [unit for unit, lacking in task.lacking.items() if each in lacking]
            if not asking and not in_batches:
                continue
            self.at(asking, (each,), LOADING)
            try:
                cases[each] = loaded(data, self._infos(first)[each])
            except BenchError as error:
                yield from ((unit, CaseResult(each, "failed", sentence(error))) for unit in asking)
        outcomes = {unit: self._outcomes(unit, task, cases) for unit in task.lacking}
        # all methods of one case in turn: metrics keep its reference's features
        for name, case in cases.items():
            for unit in task.lacking:
                if name in outcomes[unit]:
                    yield unit, self._scored(unit, case, outcomes[unit][name])

    def _scored(self, unit: int, case: Case, outcome: Outcome) -> CaseResult:
        """The scored case; its extracts for metrics of pairs and sets wait until the unit is complete.

        Raises CannotStore.
        """
        name = case.info.id
        if outcome.prediction is None or self.plan.stage == "predict":
            return CaseResult(name, outcome.status, outcome.message)
        scored = as_scored(outcome.prediction)
        self.at((unit,), (name,), SCORING)
        before = partial(self._before, unit, name)
        try:
            scores = score(self.metrics.of_cases, case, scored, before)
            extracts = self._extracts(unit, case, scored, scores.faults)
        except BenchError as error:  # the case itself
            return CaseResult(name, "failed", sentence(error))
        if self.metrics.wait:
            try:
                waiting.write(waiting.file(self.stored.units[unit].paths, name), extracts)
            except FileError as error:
                raise CannotStore(str(error)) from error
        return CaseResult(name, "ok", outcome.message, scores.values, scores.faults)

    def _extracts(
        self, unit: int, case: Case, prediction: Prediction, faults: Faults
    ) -> dict[str, Extract]:
        """The extracts of a case for metrics of pairs and sets, whose faults are added to those at hand.

        Raises BenchError."""
        before, of_unit = partial(self._before, unit, case.info.id), self.stored.units[unit]
        extracts = dict[str, Extract]()
        clips = _clips(self._dataset(of_unit.dataset), self.plan.task, of_unit.split)[case.info.pair]
        of_pairs = [metric for metric in self.metrics.of_pairs if clips >= metric.least]
        if of_pairs:
            extracts, added = pairs.collect(of_pairs, case, prediction, before)
            faults.update(added)
        if self.metrics.of_sets:
            real = self._data(of_unit).real is not None
            members, added = set_files.collect(self.metrics.of_sets, case, prediction, real, before)
            extracts |= set_files.extracts_of(members)
            faults.update(added)
        return extracts

    def _before(self, unit: int, case: str, metric: str) -> None:
        """Announce that a metric is asked about a case, or ("") about a unit's sets. Raises BenchError
        where it ended such a process before."""
        for one in ((unit, case, metric), (None, None, metric)):
            if why := self._left_out.get(one):
                raise BenchError(why)
        if self._again:
            self.at((unit,), (case,) if case else (), metric)

    def _outcomes(self, unit: int, task: Task, cases: Mapping[str, Case]) -> dict[str, Outcome]:
        """The outcome of every case that a unit lacks: from a stored prediction, or from a new one,
        which is then stored. A method that takes several at once is given all where any is new."""
        paths, lacking = self.stored.units[unit].paths, task.lacking[unit]
        keys = {
            case: store.case_key(self.stored.units[unit].keys, case) for case in lacking if case in cases
        }
        stored = {case: self._kept(paths, key, cases[case]) for case, key in keys.items()}
        new = [case for case, outcome in stored.items() if outcome is None]
        in_batches = self.stored.units[unit].in_batches
        predicted = (
            self._predicted(unit, cases if in_batches else {case: cases[case] for case in new})
            if new
            else {}
        )
        for case in new:
            if predicted[case].status != "missing":
                _store(paths, keys[case], cases[case], predicted[case])
        return {case: outcome or predicted[case] for case, outcome in stored.items()}

    def _kept(self, paths: ResultPaths, key: str, case: Case) -> Outcome | None:
        """The outcome where the method need not or must not be asked; None where it is to be."""
        if self.plan.external is not None:
            return elsewhere(self.plan.external, case)
        stored = None if self.plan.overwrite == "always" else _stored(paths, key, case)
        retry = (
            self.plan.overwrite == "failed"
            and stored is not None
            and stored.status in ("failed", "invalid")
        )
        if stored is not None and not retry:
            return stored
        return MISSING if self.plan.stage == "score" else None

    def _predicted(self, unit: int, cases: Mapping[str, Case]) -> dict[str, Outcome]:
        of_unit = self.stored.units[unit]
        worker = self.pool.worker(of_unit.method, of_unit.learned)
        worker.log, worker.lock = of_unit.paths.log, of_unit.lock
        self.at((unit,), list(cases), "")
        try:
            return dict(zip(cases, worker.ask(self._questions(of_unit, list(cases.values()))), strict=True))
        except OSError as error:
            raise CannotStore(f"{self.pool.folder}: cannot be written ({error.strerror})") from error

    def _questions(self, unit: Unit, cases: Sequence[Case]) -> list[Question]:
        data = self._data(unit)
        seeds = [store.case_seed(unit.seed, unit.seed_label, case.info.id) for case in cases]
        return [
            (case, context_for(unit.inputs, data, case, seed))
            for case, seed in zip(cases, seeds, strict=True)
        ]

    def _times(self, unit: Unit) -> list[timing.Time]:
        data = self._data(unit)
        worker = self.pool.worker(unit.method, unit.learned)
        worker.log, worker.lock = None, unit.lock
        infos = timing.spread(list(self._infos(unit).values()))
        return timing.measured(worker, lambda cases: self._questions(unit, cases), data, infos)

    def _data(self, unit: Unit) -> Dataset:
        return data_of(self._dataset(unit.dataset), self.plan.task)

    def _infos(self, unit: Unit) -> dict[str, CaseInfo]:
        return _infos(self._dataset(unit.dataset), self.plan.task, unit.split)


# ------------------------------------------------------------------------------------- stored outcomes
def _store(paths: ResultPaths, key: str, case: Case, outcome: Outcome) -> None:
    """A prediction as ``.npz``, a refusal or failure as ``.json``; never both. Raises CannotStore."""
    path = paths.prediction(case.info.id)
    note = path.with_suffix(".json")
    facts = {"key": key, "status": outcome.status, "message": outcome.message}
    try:
        if outcome.prediction is not None:
            predictions.write_prediction(path, outcome.prediction, key)
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
        if predictions.stored_key(path) != key:
            return None
        return _checked(path, case)
    try:
        facts = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        return Outcome(facts["status"], facts["message"]) if facts["key"] == key else None
    except (OSError, ValueError, KeyError):
        return None


def elsewhere(folder: Path, case: Case) -> Outcome:
    """A prediction made by somebody else, found by the case's file name; its message is a doubt of it."""
    stem = store.case_file(case.info.id)
    files = [path for suffix in (".npz", ".bvh") if (path := folder / (stem + suffix)).exists()]
    if len(files) == 2:
        return Outcome("invalid", f"{folder} has both {stem}.npz and {stem}.bvh; remove one")
    if not files:
        return Outcome("missing", f"{folder} has no {stem}.npz or .bvh")
    outcome = _checked(files[0], case)
    if outcome.prediction is None:
        return outcome
    return replace(outcome, message=conventions.doubt(outcome.prediction, case))


def _checked(path: Path, case: Case) -> Outcome:
    try:
        prediction: Prediction = predictions.read_prediction(path, case.target, case.source.fps)
        return Outcome("ok", prediction=verified(prediction, case))
    except (Invalid, FileError) as error:
        return Outcome("invalid", str(error))


@lru_cache(maxsize=8)
def _infos(data: BoundDataset, task: str, split: str) -> dict[str, CaseInfo]:
    return {info.id: info for info in plan.cases(data, task, split)}


@lru_cache(maxsize=8)
def _clips(data: BoundDataset, task: str, split: str) -> Counter[str]:
    """Pair of bodies -> its clips."""
    return Counter(info.pair for info in _infos(data, task, split).values())
