"""Shards: the jobs of a plan, cut into pieces of a minute or so that any machine can carry out."""

import platform
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, Self, TypeVar

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.answers import Answer, Progress, answers, entries, size
from retarget_bench.evaluation.process_pool import LocalPool
from retarget_bench.evaluation.stored_plan import StoredPlan, machine_facts
from retarget_bench.evaluation.worker import CaseJob, Stop, register_plugins, work
from retarget_bench.files import scratch_folder

SHORTEST, LONGEST = 30.0, 120.0
"""Seconds of a shard, as far as they can be told; a single job may take longer."""
SHARDS = 64
"""So many, where they are neither too short nor too long."""
GROUPS = 8
"""At most so many groups of jobs are timed, the largest ones; the others are taken for average."""
FLUSH = 5.0
"""Seconds after which finished answers are written."""

Timed = tuple[float, list[Answer] | Stop]
T = TypeVar("T")


def unseen(done: int, total: int) -> None:
    """Progress that nobody watches."""
    del done, total


# ------------------------------------------------------------------------------------- time and cutting
def timed(jobs: Sequence[CaseJob]) -> list[Timed]:
    """Carry out jobs one after the other in this process; the seconds and the result of each."""
    found = []
    for job in jobs:
        start = time.perf_counter()
        result = work(job)
        found.append((time.perf_counter() - start, result))
    return found


class Sample:
    """Two jobs of every large group of jobs, carried out here to learn how long the others take.

    The first, the shortest, loads and starts what is needed; the second, of middle length, is timed.
    frames: those of a job's cases. Jobs of a group ask the same methods for cases of the same data set.
    """

    def __init__(self, jobs: Sequence[CaseJob], frames: Callable[[CaseJob], int]) -> None:
        self.jobs, self._frames = jobs, frames
        groups: dict[object, list[int]] = {}
        for number, job in enumerate(jobs):
            groups.setdefault(_group(job), []).append(number)
        self.left = set(range(len(jobs)))
        self._rates: dict[object, float] = {}
        self._chosen = []
        for group in sorted(groups.values(), key=len, reverse=True)[:GROUPS]:
            ordered = sorted(group, key=lambda number: frames(jobs[number]))
            self._chosen.append(list(dict.fromkeys((ordered[0], ordered[len(ordered) // 2]))))

    def answers(self, pool: LocalPool) -> Iterator[Answer]:
        """Carry it out. Jobs that killed their process are left to those who can try them again."""
        payloads = [[self.jobs[number] for number in numbers] for numbers in self._chosen]
        for done in pool.run(timed, payloads):
            numbers = self._chosen[done.job]
            for number, (seconds, result) in zip(numbers, done.result or (), strict=False):
                job = self.jobs[number]
                self._rates[_group(job)] = seconds / max(self._frames(job), 1)
                self.left.discard(number)
                yield from entries(result)

    def seconds(self, job: CaseJob) -> float:
        """An estimate, in proportion to frames."""
        average = sum(self._rates.values()) / max(len(self._rates), 1)
        return self._rates.get(_group(job), average) * max(self._frames(job), 1)

    def shards(self) -> list[list[int]]:
        """The numbers of the jobs that are left, cut."""
        return cut(sorted(self.left), lambda number: self.seconds(self.jobs[number]))


def cut(jobs: Sequence[T], seconds: Callable[[T], float]) -> list[list[T]]:
    """Jobs, or their numbers, in their order as shards of nearly equal times."""
    times = [seconds(job) for job in jobs]
    total = sum(times)
    wanted = max(1, round(total / min(max(total / SHARDS, SHORTEST), LONGEST)))
    shards: list[list[T]] = [[] for _ in range(wanted)]
    spent = 0.0
    for job, each in zip(jobs, times, strict=True):
        middle = (spent + each / 2) / total if total else 0.0
        shards[min(int(middle * wanted), wanted - 1)].append(job)
        spent += each
    return [shard for shard in shards if shard]


def _group(job: CaseJob) -> object:
    return job.dataset, tuple(part.method for part in job.parts), len(job.cases) > 1


# -------------------------------------------------------------------------------------------- carrying out
class ShardWorker:
    """Processes that carry out shards of one plan; they serve all of them until the ``with`` block ends."""

    def __init__(self, folder: Path, workers: int) -> None:
        self.stored = StoredPlan(folder)
        self._open = ExitStack()
        self._scratch = self._open.enter_context(scratch_folder())
        self._pool = self._open.enter_context(LocalPool(workers))
        self._checked = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def carry_out(self, number: int, progress: Progress = unseen) -> None:
        """Compute what a shard lacks, and write it as it is finished.

        Interrupted at any moment, it is to be carried out again: what is written is not computed anew.
        Raises BenchError, also where results of this machine would not be those of the others.
        """
        jobs = [replace(job, scratch=self._scratch) for job in self.stored.lacking(number)]
        if jobs and not self._checked:
            self._check()
        found: list[Answer] = []
        written = time.monotonic()
        try:
            for answer in answers(self._pool, jobs, sum(map(size, jobs)), progress):
                found.append(answer)
                if time.monotonic() - written > FLUSH:
                    self.stored.write_part(number, found)
                    found, written = [], time.monotonic()
        finally:
            if found:
                self.stored.write_part(number, found)

    def _check(self) -> None:
        (done,) = self._pool.run(difference, [self.stored.folder])
        if problem := done.error or done.result:
            raise BenchError(problem)
        self._checked = True


def difference(folder: Path) -> str:
    """A sentence on what this machine has that the stored plan was not made with; "" where all agrees."""
    stored = StoredPlan(folder)
    register_plugins(stored.plan.plugin_files)
    theirs: Mapping[str, Any] = stored.facts["common"]
    mine = machine_facts(stored.plan, {unit.method for unit in stored.units}, stored.plan.datasets)
    for name in sorted(theirs.keys() | mine.keys()):
        if (here := mine.get(name, "none")) != (there := theirs.get(name, "none")):
            return (
                f"{platform.node()} has {name} {here} where the run was planned with {there}; all "
                "machines need the same versions, code and data"
            )
    return ""
