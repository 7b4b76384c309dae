"""Speed of methods: measured alone, in one process and one thread, after a warm-up, without files.

Times stand in files of their own, never in rows or keys: they differ from run to run and machine to
machine, and rows must not. All that is told of speeds is read from there. Beside every time stands that of
a fixed piece of work at the same moment, the yardstick, so that times of a busy moment, or of a slower
machine, are not shown as if they were of a quiet one.
"""

import math
import statistics
import time
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
TRIES = 3
"""A case is timed so often at most, where the machine is busy meanwhile."""
SLOWER = 1.5
"""Ratio of yardsticks from which times are not compared."""
WORK = 60_000
FIELDS = ("case", "frames", "seconds", "yardstick")
OLD_FIELDS = FIELDS[:3]


@dataclass(frozen=True)
class Time:
    """The seconds that a method takes for a case, and those of the yardstick meanwhile; nan: not known."""

    case: str
    frames: int
    seconds: float
    yardstick: float = math.nan


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
    """Write times for every method of a plan that has results but no times newer than them, or such that
    were taken while the machine was busier than now.

    They are taken on the last split, one method after the other while the other workers have nothing to do,
    and are those of the method on all splits.
    """
    units: dict[tuple[Spec, Spec], list[EvaluationUnit]] = {}
    for unit in evaluation_units(plan) if plan.external is None else ():
        if not unit.seed_number and unit.paths.header.exists():
            units.setdefault((unit.dataset, unit.method), []).append(unit)
    now = yardstick()
    wanted = [mine[-1] for mine in units.values() if _stale([unit.paths for unit in mine], now)]
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
            rows = [(t.case, t.frames, f"{t.seconds:.6g}", f"{t.yardstick:.6g}") for t in done.result]
            write_csv(paths.timing, FIELDS, rows)
            for other in _times(paths):
                if other != paths:
                    other.timing.unlink()


def spread(infos: Sequence[CaseInfo]) -> tuple[CaseInfo, ...]:
    """A few cases, evenly spread over the list."""
    step = max(1, len(infos) // CASES)
    return tuple(infos[::step][:CASES])


def yardstick() -> float:
    """Seconds of a fixed piece of work in one thread: the middle one of three."""
    taken = []
    for _ in range(3):
        start = time.perf_counter()
        sum(number * number for number in range(WORK))
        taken.append(time.perf_counter() - start)
    return sorted(taken)[1]


def time_method(job: TimingJob) -> list[Time]:
    """Median seconds for a few cases, the first of which was run once before."""
    register_plugins(job.plan.plugin_files)
    data = dataset(job.dataset, job.plan.task)
    worker = prediction_worker(job.plan, job.method, job.scratch, job.preload)
    worker.log = None
    times: list[Time] = []
    spent, marks = 0.0, [yardstick()]
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
        tries: list[Time] = []
        for _ in range(TRIES):
            (outcome,) = worker.ask(asked, REPEATS)
            spent += REPEATS * worker.seconds
            marks.append(yardstick())
            if outcome.prediction is not None:
                tries.append(Time(info.id, case.source.frames, worker.seconds, max(marks[-2:])))
            if max(marks[-2:]) <= SLOWER * min(marks) or spent > ENOUGH_SECONDS:
                break
        if tries:
            times.append(min(tries, key=lambda each: each.yardstick))
    return times


def read(paths: ResultPaths, clips: Container[str] | None = None) -> list[Time]:
    """The times of the cases that a method was timed on; empty where there are none.

    They may be of another split than these results, which a quick look has none of. clips: only of these
    clips.
    """
    for place in _times(paths)[: paths.finished]:
        times = _read(place)
        if clips is None:
            return times
        clip = {info.id: info.clip for info in read_cases(place.cases, place.task, place.split)}
        return [each for each in times if clip.get(each.case) in clips]
    return []


def _read(place: ResultPaths) -> list[Time]:
    """The times in a file; those of earlier versions are without yardsticks. Raises FileError."""
    try:
        fields = place.timing.read_text(encoding="utf-8").partition("\n")[0].split(",")
        old = tuple(fields) == OLD_FIELDS
        rows = read_csv(place.timing, OLD_FIELDS if old else FIELDS)
        return [Time(case, int(frames), *map(float, seconds)) for case, frames, *seconds in rows]
    except (FileError, OSError, ValueError) as error:
        raise FileError(place.timing, f"cannot be read as times ({error}); delete it") from error


def rate(times: Sequence[Time]) -> float | None:
    """Frames per second; None where there are no times."""
    seconds = sum(each.seconds for each in times)
    return sum(each.frames for each in times) / seconds if seconds > 0 else None


def pace(times: Sequence[Time]) -> float:
    """The middle one of the yardsticks of times, in seconds; nan where there are none."""
    return statistics.median(each.yardstick for each in times) if times else math.nan


def _times(paths: ResultPaths) -> list[ResultPaths]:
    """The splits of the same method that have times, its own first."""
    places = [paths, *(replace(paths, split=split) for split in SPLITS[::-1] if split != paths.split)]
    return [place for place in places if place.timing.exists()]


def _stale(places: Sequence[ResultPaths], now: float) -> bool:
    """now: the yardstick."""
    if not (timed := _times(places[-1])):
        return True
    newest = max(place.timing.stat().st_mtime for place in timed)
    older = newest < max(place.header.stat().st_mtime for place in places)
    return older or pace(_read(timed[0])) > SLOWER * now
