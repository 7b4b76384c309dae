"""Speed of methods: measured alone, in one process and one thread, after a warm-up, without files.

Times stand in files of their own, never in rows or keys: they differ from run to run and machine to
machine, and rows must not.
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from retarget_bench.api import SPLITS, CaseInfo
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation.plan import (
    EvaluationUnit,
    Plan,
    dataset,
    evaluation_units,
    located,
)
from retarget_bench.evaluation.predict import Inputs, context_for
from retarget_bench.evaluation.process_pool import LocalPool
from retarget_bench.evaluation.worker import prediction_worker, register_plugins
from retarget_bench.files import write_csv
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import ResultPaths, case_seed, read_cases, read_csv

CASES = 5
REPEATS = 3
ENOUGH_SECONDS = 0.5
FIELDS = ("case", "frames", "seconds")


@dataclass(frozen=True)
class TimingJob:
    """A method that is to be timed on some cases of a data set; scratch, preload: as in ``CaseJob``."""

    plan: Plan
    dataset: Spec
    method: Spec
    inputs: Inputs
    cases: tuple[CaseInfo, ...]
    scratch: Path
    preload: tuple[str, ...] = ()


def measure(plan: Plan, pool: LocalPool, scratch: Path, preload: tuple[str, ...] = ()) -> None:
    """Write times for every method of a plan that has results but no times newer than them.

    They are taken on the last split, one method after the other while the other workers have nothing to do,
    and are those of the method on all splits.
    """
    units: dict[tuple[Spec, Spec], list[EvaluationUnit]] = {}
    for unit in evaluation_units(plan) if plan.external is None else ():
        if not unit.seed_number and unit.paths.header.exists():
            units.setdefault((unit.dataset, unit.method), []).append(unit)
    wanted = [mine[-1] for mine in units.values() if _stale([unit.paths for unit in mine])]
    jobs = [
        TimingJob(
            plan,
            unit.dataset,
            located(unit.method),
            Inputs.of(unit.built),
            spread(unit.infos),
            scratch,
            preload,
        )
        for unit in wanted
    ]
    for done in pool.run(time_method, jobs, workers=1):
        if done.result is not None:
            paths = wanted[done.job].paths
            rows = ((case, frames, f"{seconds:.6g}") for case, frames, seconds in done.result)
            write_csv(paths.timing, FIELDS, rows)
            for other in _times(paths):
                if other != paths:
                    other.timing.unlink()


def spread(infos: Sequence[CaseInfo]) -> tuple[CaseInfo, ...]:
    """A few cases, evenly spread over the list."""
    step = max(1, len(infos) // CASES)
    return tuple(infos[::step][:CASES])


def time_method(job: TimingJob) -> list[tuple[str, int, float]]:
    """(case, frames, median seconds) for a few cases, the first of which was run once before."""
    register_plugins(job.plan.plugin_files)
    data = dataset(job.dataset)
    worker = prediction_worker(job.plan, job.method, job.scratch, job.preload)
    worker.log = None
    times: list[tuple[str, int, float]] = []
    spent = 0.0
    for info in job.cases:
        if spent > ENOUGH_SECONDS:
            break
        try:
            case = data.load(info)
        except BenchError:
            continue
        seed = case_seed(job.plan.seed, str(job.method), info.id)
        asked = [(case, context_for(job.inputs, data, case, seed))]
        if not times and worker.ask(asked)[0].prediction is None:
            continue
        (outcome,) = worker.ask(asked, REPEATS)
        spent += REPEATS * worker.seconds
        if outcome.prediction is not None:
            times.append((info.id, case.source.frames, worker.seconds))
    return times


def read(paths: ResultPaths, clips: Container[str] | None = None) -> list[tuple[int, float]]:
    """(frames, seconds) of the cases that a method was timed on; empty where there are none.

    They may be of another split than these results, which a quick look has none of. clips: only of these
    clips.
    """
    for place in _times(paths)[: paths.finished]:
        try:
            times = [(case, int(frames), float(s)) for case, frames, s in read_csv(place.timing, FIELDS)]
        except (FileError, ValueError) as error:
            raise FileError(place.timing, f"cannot be read as times ({error}); delete it") from error
        if clips is None:
            return [(frames, seconds) for _, frames, seconds in times]
        clip = {info.id: info.clip for info in read_cases(place.cases, place.task, place.split)}
        return [(frames, seconds) for case, frames, seconds in times if clip.get(case) in clips]
    return []


def _times(paths: ResultPaths) -> list[ResultPaths]:
    """The splits of the same method that have times, its own first."""
    places = [paths, *(replace(paths, split=split) for split in SPLITS[::-1] if split != paths.split)]
    return [place for place in places if place.timing.exists()]


def _stale(places: Sequence[ResultPaths]) -> bool:
    times = [place.timing.stat().st_mtime for place in _times(places[-1])]
    return max(times, default=0.0) < max(place.header.stat().st_mtime for place in places)
