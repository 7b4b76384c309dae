"""Engines that carry out shards of a plan: processes of this machine, Ray, SLURM, or a person.

An engine takes the shards of a stored plan and yields each when it has ended. Their answers
lie in files (``evaluation/shards.py``), for all engines alike.
"""

from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Protocol

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.executors.local import Local
from retarget_bench.evaluation.executors.ray_tasks import RayTasks
from retarget_bench.evaluation.executors.slurm_arrays import SlurmArrays
from retarget_bench.plugins import parameters
from retarget_bench.plugins.spec import Spec

LOCAL = "local"


class Engine(Protocol):
    """An engine for shards, made with the options in its brackets. Raises BenchError for wrong ones."""

    def run(self, folder: Path, numbers: Sequence[int], /) -> Generator[tuple[int, str], None, None]:
        """Carry out shards of a stored plan; each as it ends, with "" or why it was not completed. What
        still runs ends when the iterator is closed. Raises BenchError where nothing can be reached."""


class ByHand:
    """Ends the run once its shards are stored; its repetition takes up what they answered."""

    def run(self, folder: Path, numbers: Sequence[int]) -> Generator[tuple[int, str], None, None]:
        """Raises BenchError that says what to do."""
        raise BenchError(
            f"the shards 0 to {numbers[-1]} are to be carried out: bench work {folder} SHARD. Then run "
            "again to take up what they answered"
        )


ENGINES: dict[str, Callable[..., Engine]] = {"ray": RayTasks, "slurm": SlurmArrays, "hand": ByHand}


def engine(executor: str, local: Local) -> Engine:
    """The engine of ``ray[cpus=2]``; ``local`` for the processes of this machine.

    Raises BenchError for unknown ones and unknown parameters.
    """
    spec = Spec.parse(executor)
    if spec.posts or spec.name not in (LOCAL, *ENGINES):
        raise BenchError(f"no executor is called {spec}; there are {', '.join((LOCAL, *ENGINES))}")
    if spec.name == LOCAL:
        if spec.parameters:
            raise BenchError("the executor local takes no parameters; --jobs sets its processes")
        return local
    factory = ENGINES[spec.name]
    return factory(**parameters.fit(spec, factory).parameters)
