"""Cost of a method: memory and speed of one process with one thread."""

from __future__ import annotations

import sys
from dataclasses import dataclass

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.plan import Plan, dataset, method
from retarget_bench.evaluation.predict import context_for, predict
from retarget_bench.evaluation.process_pool import LocalPool
from retarget_bench.evaluation.timing import TimingJob, spread, time_method
from retarget_bench.evaluation.worker import register_plugins
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import case_seed


@dataclass(frozen=True)
class Measured:
    """peak_memory_mb: by how much the process grew. frames_per_second: of the timed cases together."""

    peak_memory_mb: float
    frames_per_second: float


def measure(asked: Spec, data: Spec) -> Measured:
    """Memory and speed of a method on a few cases, in a process of its own.

    Raises BenchError where the method answers none of them.
    """
    plan = Plan(methods=(asked,), datasets=(data,))
    (done,) = LocalPool(1).run(of_process, [(plan, asked, data)])
    if done.error or done.result is None:
        raise BenchError(f"the cost of {asked} cannot be measured: {done.error or 'it answers no case'}")
    return Measured(*done.result)


def of_process(job: tuple[Plan, Spec, Spec]) -> tuple[float, float] | None:
    """(megabytes, frames per second), or None where no case is answered."""
    plan, asked, spec = job
    register_plugins(plan.plugin_files)
    data = dataset(spec)
    infos = [info for split in data.card.splits for info in data.cases("retarget", split)]
    cases = [(info, data.load(info)) for info in spread(infos)]
    before = _peak_mb()
    built = method(asked)
    for info, case in cases:
        predict(built, case, context_for(built, data, case, case_seed(0, str(asked), info.id)))
    grown = _peak_mb() - before
    times = time_method(TimingJob(plan, spec, asked, tuple(info for info, _ in cases)))
    seconds = sum(second for _, _, second in times)
    return (grown, sum(frames for _, frames, _ in times) / seconds) if seconds > 0 else None


def _peak_mb() -> float:
    """The most memory that this process ever held, in megabytes; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)
