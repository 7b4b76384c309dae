"""Answers to jobs as a pool gives them; what killed its process is tried again in smaller pieces."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.process_pool import LocalPool
from retarget_bench.evaluation.worker import CaseJob, Stop, work
from retarget_bench.results.store import CaseResult, ResultPaths

Answer = tuple[ResultPaths, CaseResult]
Progress = Callable[[int, int], None]
"""Called with the number of cases done and of all that are to be asked."""


def answers(pool: LocalPool, jobs: Sequence[CaseJob], total: int, progress: Progress) -> Iterator[Answer]:
    """Entries as they come, of which the jobs ask for ``total``. A job whose process died twice is tried
    again, one method at a time, and then one case at a time, so that it costs the method and the case that
    did it and no other."""
    count = 0
    progress(0, total)
    while jobs:
        again: list[CaseJob] = []
        for answer in pool.run(work, jobs):
            job = jobs[answer.job]
            if not answer.error:
                yield from entries(answer.result)
            elif apart := _apart(job):
                again += apart
                total += sum(map(size, apart))
            else:
                (part,) = job.parts
                yield from ((part.paths, CaseResult(case, "failed", answer.error)) for case in part.keys)
            count += size(job)
            progress(count, total)
        jobs = again


def size(job: CaseJob) -> int:
    """The number of answers, each of one method to one case, that a job is to make."""
    return sum(len(part.keys) for part in job.parts)


def entries(result: list[Answer] | Stop) -> list[Answer]:
    """The answers of a job. Raises BenchError where the run must end."""
    if isinstance(result, Stop):
        raise BenchError(f"stopped: {result.reason}. What was finished is kept; run again to continue")
    return result


def _apart(job: CaseJob) -> list[CaseJob]:
    """A job as jobs of one method, and one of a single method as jobs of one case; none where it is both.

    A method is given its whole batch as long as that is possible, since in another one it rounds otherwise.
    """
    if len(job.parts) > 1:
        return [replace(job, parts=(part,)) for part in job.parts]
    if len(job.cases) == 1:
        return []
    return [
        replace(job, cases=(case,), parts=(replace(part, keys={case: key}),))
        for part in job.parts
        for case, key in part.keys.items()
    ]
