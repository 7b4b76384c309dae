"""Shards as arrays of jobs of SLURM, submitted and followed by submitit."""

import re
import shutil
import subprocess
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.executors.local import Local
from retarget_bench.plugins.spec import Scalar

MINUTES = 60
"""Time limit of a job that has none of its own: many times what its shards should take."""
POLL = 0.5
"""Seconds between two polls of which jobs have ended."""
USUAL_ARRAY = 1000
"""Jobs of an array where the site does not say how many it allows: one less than SLURM's default."""


class SlurmArrays:
    """Jobs of several shards each, in arrays that the site allows.

    shards:  per job. cpus: processes of a job.
    array:   at most so many jobs an array; 0: what ``scontrol`` says.
    cluster: ``local`` runs the jobs as processes of this machine at once, to try things out.
    sbatch:  other options of ``sbatch`` as submitit names them: ``partition``, ``time`` (minutes), ``mem``,
             ``account``, ``qos``, ``gres``, ``array_parallelism`` ...
    """

    def __init__(
        self,
        shards: int = 4,
        cpus: int = 1,
        array: int = 0,
        cluster: Literal["slurm", "local"] = "slurm",
        **sbatch: Scalar,
    ) -> None:
        if find_spec("submitit") is None:
            raise BenchError(
                "the executor slurm needs the package submitit: pip install 'retarget-bench[slurm]'"
            )
        if shards < 1 or cpus < 1 or array < 0:
            raise BenchError("shards and cpus of the executor slurm are 1 or more, array 0 or more")
        if cluster == "slurm" and shutil.which("sbatch") is None:
            raise BenchError("the executor slurm needs the command sbatch: run it where jobs are submitted")
        self._each, self._cpus, self._array, self._cluster = shards, cpus, array, cluster
        self._sbatch = {"time": MINUTES, "job_name": "retarget-bench", **sbatch}

    def run(self, folder: Path, numbers: Sequence[int]) -> Generator[tuple[int, str], None, None]:
        jobs: list[tuple[Any, Sequence[int]]] = []
        try:
            jobs += self._submitted(folder, numbers)
            while jobs:
                for each in [each for each in jobs if each[0].done()]:
                    jobs.remove(each)
                    job, shards = each
                    yield from (_outcome(job) or dict.fromkeys(shards, _why(job))).items()
                time.sleep(POLL if jobs else 0.0)
        finally:
            for job, _shards in jobs:
                with suppress(OSError, subprocess.SubprocessError):
                    job.cancel(check=False)

    def _submitted(self, folder: Path, numbers: Sequence[int]) -> Iterator[tuple[Any, Sequence[int]]]:
        """Jobs and their shards. Raises BenchError."""
        batches = [list(numbers[at : at + self._each]) for at in range(0, len(numbers), self._each)]
        limit = self._array or array_limit()
        try:
            executor = self._executor(folder / "slurm")
            for at in range(0, len(batches), limit):
                some = batches[at : at + limit]
                jobs = executor.map_array(Carrying(self._cpus), [str(folder)] * len(some), some)
                yield from zip(jobs, some, strict=True)
        except Exception as error:  # submitit's errors have no class in common
            message = " ".join(str(error).split())[:500]
            raise BenchError(f"the jobs could not be submitted to SLURM: {message}") from error

    def _executor(self, folder: Path) -> Any:
        import submitit

        if self._cluster == "local":
            executor = submitit.LocalExecutor(folder)
            executor.update_parameters(timeout_min=self._sbatch["time"])
            return executor
        executor = submitit.SlurmExecutor(folder)
        executor.update_parameters(cpus_per_task=self._cpus, **self._sbatch)
        return executor


def _outcome(job: Any) -> dict[int, str] | None:
    """The result of a job by shard; None where it ended without one."""
    try:
        return dict(job.result())
    except Exception:  # submitit's own classes, one of which holds the text of any error of the job
        return None


def _why(job: Any) -> str:
    return f"its job {job.job_id} ended without a result ({job.state}); see {job.paths.stderr}"


def array_limit() -> int:
    """The most jobs of an array that the site allows."""
    with suppress(OSError, subprocess.SubprocessError):
        command = ["scontrol", "show", "config"]
        output = subprocess.run(command, capture_output=True, text=True, timeout=30, check=True).stdout
        if match := re.search(r"^MaxArraySize\s*=\s*(\d+)", output, re.MULTILINE):
            return max(1, int(match[1]) - 1)
    return USUAL_ARRAY


class Carrying:
    """The function of a job; where it is preempted or out of time, submitit submits it again."""

    def __init__(self, cpus: int) -> None:
        self.cpus = cpus

    def __call__(self, folder: str, shards: Sequence[int]) -> dict[int, str]:
        """Shard -> why it ended before it was complete, or ""."""
        with Local(self.cpus, check=True) as local:
            return local.problems(Path(folder), shards)

    def checkpoint(self, folder: str, shards: Sequence[int]) -> Any:
        from submitit.helpers import DelayedSubmission

        return DelayedSubmission(self, folder, shards)
