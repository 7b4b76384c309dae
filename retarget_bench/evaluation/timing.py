"""Speed of methods: measured alone, in one process and one thread, after a warm-up.

Times stand in files of their own, never in rows or keys: they differ from run to run and machine to
machine, and rows must not.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation.plan import Plan, dataset, evaluation_units, method
from retarget_bench.evaluation.predict import context_for, predict
from retarget_bench.evaluation.process_pool import LocalPool
from retarget_bench.evaluation.worker import register_plugins
from retarget_bench.files import write_csv
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import ResultPaths, case_seed, read_csv

CASES = 5
REPEATS = 3
ENOUGH_SECONDS = 0.5
FIELDS = ("case", "frames", "seconds")


@dataclass(frozen=True)
class TimingJob:
    """A method that is to be timed on some cases of a data set."""

    plan: Plan
    dataset: Spec
    method: Spec
    cases: tuple[CaseInfo, ...]


def measure(plan: Plan) -> None:
    """Write times for every unit of a plan that has results but no times newer than them."""
    wanted = [
        unit
        for unit in evaluation_units(plan)
        if plan.external is None and not unit.seed_number and _stale(unit.paths)
    ]
    jobs = [TimingJob(plan, unit.dataset, unit.method, spread(unit.infos)) for unit in wanted]
    for done in LocalPool(1).run(time_method, jobs):
        if done.result is not None:
            rows = ((case, frames, f"{seconds:.6g}") for case, frames, seconds in done.result)
            write_csv(wanted[done.job].paths.timing, FIELDS, rows)


def spread(infos: Sequence[CaseInfo]) -> tuple[CaseInfo, ...]:
    """A few cases, evenly spread over the list."""
    step = max(1, len(infos) // CASES)
    return tuple(infos[::step][:CASES])


def time_method(job: TimingJob) -> list[tuple[str, int, float]]:
    """(case, frames, median seconds) for a few cases, the first of which was run once before."""
    register_plugins(job.plan.plugin_files)
    asked, data = method(job.method), dataset(job.dataset)
    times: list[tuple[str, int, float]] = []
    spent = 0.0
    for info in job.cases:
        if spent > ENOUGH_SECONDS:
            break
        try:
            case = data.load(info)
        except BenchError:
            continue
        context = context_for(asked, data, case, case_seed(job.plan.seed, str(job.method), info.id))
        if not times and predict(asked, case, context).prediction is None:
            continue
        seconds = []
        for _ in range(REPEATS):
            start = time.perf_counter()
            outcome = predict(asked, case, context)
            seconds.append(time.perf_counter() - start)
        spent += sum(seconds)
        if outcome.prediction is not None:
            times.append((info.id, case.source.frames, sorted(seconds)[REPEATS // 2]))
    return times


def read(paths: ResultPaths) -> list[tuple[int, float]]:
    """(frames, seconds) of the timed cases; empty where none were timed."""
    if not paths.timing.exists():
        return []
    try:
        return [(int(frames), float(seconds)) for _, frames, seconds in read_csv(paths.timing, FIELDS)]
    except (FileError, ValueError) as error:
        raise FileError(paths.timing, f"cannot be read as times ({error}); delete it") from error


def _stale(paths: ResultPaths) -> bool:
    if not paths.rows.exists():
        return False
    return not paths.timing.exists() or paths.timing.stat().st_mtime < paths.rows.stat().st_mtime
