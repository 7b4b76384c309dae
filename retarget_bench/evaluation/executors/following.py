"""A run by an engine: a sample here, shards there, and the answers as they come."""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.answers import Answer, Progress
from retarget_bench.evaluation.executors import Engine
from retarget_bench.evaluation.jobs import Jobs
from retarget_bench.evaluation.plan import EvaluationUnit
from retarget_bench.evaluation.process_pool import LocalPool
from retarget_bench.evaluation.shards import Sample
from retarget_bench.evaluation.stored_plan import StoredPlan
from retarget_bench.evaluation.worker import CaseJob
from retarget_bench.results.store import ResultPaths

LOOK = 0.5
"""Seconds between two looks at what has come."""
PATIENCE = 60.0
"""Seconds in which the answers of a shard that has ended must appear: shared file systems are slow."""


def answers(
    engine: Engine,
    units: Mapping[ResultPaths, EvaluationUnit],
    pool: LocalPool,
    jobs: Jobs,
    progress: Progress,
) -> Iterator[Answer]:
    """Entries as they come. Raises BenchError when all is there but what lost shards had to answer."""
    if not jobs:
        return
    count, total = 0, jobs.answers
    progress(0, total)
    with engine:
        sample = Sample(jobs, _lengths(units.values()))
        for answer in sample.answers(pool):
            yield answer
            count += 1
            progress(count, total)
        if not (shards := sample.shards()):
            return
        plan = jobs[0].plan
        keys = {paths: unit.keys for paths, unit in units.items()}
        stored = StoredPlan.write(plan, jobs, shards, keys)
        engine.submit(stored.folder, range(len(shards)))
        following = Following(stored)
        for paths, entry in following.answers(engine):
            yield replace(paths, root=plan.root), entry
            count += 1
            progress(count, total)
    following.check()
    stored.remove()


class Following:
    """The answers of shards as they come."""

    def __init__(self, stored: StoredPlan) -> None:
        self.stored = stored
        self._left: dict[int, int] = dict(enumerate(stored.facts["sizes"]))
        self._shards = len(self._left)
        self._seen: dict[int, set[tuple[ResultPaths, str]]] = {}
        self._parts: set[str] = set()
        self._lost: dict[int, str] = {}

    def answers(self, engine: Engine) -> Iterator[Answer]:
        """Each once, until all are there or lost."""
        late: dict[int, float] = {}
        while True:
            ended = engine.ended()  # asked before the parts are read, so that theirs are among them
            yield from self._new()
            for shard, why in ended.items():
                if shard in self._left:
                    late[shard] = 0.0 if why else time.monotonic() + PATIENCE
                    self._lost[shard] = why or "it ended, but not all of its answers are to be seen here"
            for shard, until in late.items():
                if shard in self._left and time.monotonic() > until:
                    del self._left[shard]
            if not self._left:
                return
            time.sleep(LOOK)

    def _new(self) -> Iterator[Answer]:
        for shard, found in self.stored.new_parts(self._parts):
            if shard not in self._left:
                continue  # complete: a copy of it that was believed dead
            seen = self._seen.setdefault(shard, set())
            for paths, entry in found:
                if (paths, entry.case) not in seen:
                    seen.add((paths, entry.case))
                    yield paths, entry
            if len(seen) == self._left[shard]:
                del self._left[shard], self._seen[shard]
                self._lost.pop(shard, None)

    def check(self) -> None:
        """Raises BenchError where shards were lost."""
        if self._lost:
            shard, why = min(self._lost.items())
            raise BenchError(
                f"{len(self._lost)} of {self._shards} shards were lost; shard {shard}: {why}. What was "
                "finished is kept; run again to continue"
            )


def _lengths(units: Iterable[EvaluationUnit]) -> Callable[[CaseJob], int]:
    """A function of the frames of a job's cases."""
    frames = {(u.dataset, u.split): {info.id: info.frames for info in u.infos} for u in units}
    return lambda job: sum(frames[job.dataset, job.split][case] for case in job.cases)
