"""Where shards of a plan are carried out: on Ray or SLURM, by engines that exist, or by hand.

An engine is given shards (``submit``), says which of them have ended (``ended``), and ends the others when
its ``with`` block ends. What shards answer comes by files (``evaluation/stored_plan.py``), for all alike.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Protocol, Self

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.executors.by_hand import ByHand
from retarget_bench.evaluation.executors.ray_tasks import RayTasks
from retarget_bench.evaluation.executors.slurm_arrays import SlurmArrays
from retarget_bench.plugins import parameters
from retarget_bench.plugins.spec import Spec

LOCAL = "local"


class Engine(Protocol):
    """What runs shards. Raises BenchError where it cannot be reached or asks for what is not there."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...

    def submit(self, folder: Path, shards: Sequence[int]) -> None:
        """Have the shards of a stored plan carried out. Called once."""

    def ended(self) -> Mapping[int, str]:
        """The shards that have ended since the last call: "", or why before they were complete."""


ENGINES: dict[str, Callable[..., Engine]] = {"ray": RayTasks, "slurm": SlurmArrays, "hand": ByHand}


def engine(executor: str) -> Engine | None:
    """The engine of ``ray[cpus=2]``; None for the local pool.

    Raises BenchError for unknown ones and unknown parameters.
    """
    spec = Spec.parse(executor)
    if spec.posts or spec.name not in (LOCAL, *ENGINES):
        raise BenchError(f"no executor is called {spec}; there are {', '.join((LOCAL, *ENGINES))}")
    if spec.name == LOCAL:
        if spec.parameters:
            raise BenchError("the executor local takes no parameters; --jobs sets its processes")
        return None
    factory = ENGINES[spec.name]
    return factory(**parameters.fit(spec, factory).parameters)
