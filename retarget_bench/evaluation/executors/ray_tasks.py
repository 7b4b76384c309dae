"""Shards as tasks of Ray, which knows where there is room for them and repeats what a lost node had."""

import atexit
import os
import re
import socket
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.executors.local import Local
from retarget_bench.evaluation.prediction.launch import MARK


class RayTasks:
    """One task a shard, which takes one processor, ``memory`` (GB) and ``gpus`` (also fractions);
    ``retries``: so often it is begun again when its worker or its node has died.

    address: of a cluster; without one ``RAY_ADDRESS``, a Ray that runs here already, or else one that is
    started for the run.
    """

    def __init__(self, address: str = "", memory: float = 0.0, gpus: float = 0.0, retries: int = 3) -> None:
        if find_spec("ray") is None:
            raise BenchError("the executor ray needs the package ray: pip install 'retarget-bench[ray]'")
        self._address = address
        self._options: dict[str, Any] = {"num_cpus": 1, "num_gpus": gpus, "max_retries": retries}
        if memory:
            self._options["memory"] = int(memory * 2**30)

    def run(self, folder: Path, numbers: Sequence[int]) -> Generator[tuple[int, str], None, None]:
        import ray

        variables = {name: text for name, text in os.environ.items() if name.startswith("RETARGET_BENCH_")}
        variables.pop(MARK, None)
        if "PYTHONPATH" in os.environ:
            variables["PYTHONPATH"] = os.environ["PYTHONPATH"]
        task = ray.remote(carry_out).options(runtime_env={"env_vars": variables}, **self._options)
        with _initialised(self._address):
            shards = {task.remote(str(folder), number): number for number in numbers}
            try:
                while shards:
                    for each in ray.wait(list(shards))[0]:
                        yield shards.pop(each), _outcome(each)
            finally:
                for each in shards:
                    ray.cancel(each, force=True)


@contextmanager
def _initialised(address: str) -> Iterator[None]:
    """A Ray to submit tasks to; one that was started or joined for it is left again. Raises BenchError."""
    import ray

    if ray.is_initialized():
        yield
        return
    where = address or os.environ.get("RAY_ADDRESS", "")
    quiet = {"include_dashboard": False, "log_to_driver": False, "logging_level": "ERROR"}
    try:
        _check_address(where)
        ray.init(where or None, **quiet)
    except (OSError, ValueError, RuntimeError, ray.exceptions.RayError) as error:
        raise BenchError(f"Ray cannot be used ({where or 'here'}): {_first_line(error)}") from error
    try:
        yield
    finally:
        ray.shutdown()


def _check_address(address: str) -> None:
    """Raises OSError where nobody answers at ``HOST:PORT``, which Ray itself finds out after minutes."""
    if match := re.fullmatch(r"(?:ray://)?([^/:]+):(\d+)", address):
        socket.create_connection((match[1], int(match[2])), timeout=10).close()


def _outcome(task: Any) -> str:
    import ray

    try:
        return str(ray.get(task))
    except ray.exceptions.RayTaskError as error:
        return f"{type(error.cause).__name__}: {_first_line(error.cause)}"
    except ray.exceptions.RayError as error:
        return _first_line(error)


def _first_line(error: BaseException) -> str:
    return next(iter(str(error).strip().splitlines()), "") or type(error).__name__


# ------------------------------------------------------------------------------------ in the worker of Ray
_LOCALS: dict[str, Local] = {}
"""Folder -> the process of this worker, which serves all shards of that stored plan that it is given."""


def carry_out(folder: str, shard: int) -> str:
    """Carry out a shard; why it ended before it was complete, or ""."""
    if folder not in _LOCALS:
        for each in list(_LOCALS):  # of another run, with code and workers of its own
            _LOCALS.pop(each).__exit__()
        _LOCALS[folder] = Local(1, check=True)
        atexit.register(_LOCALS[folder].__exit__)
    return _LOCALS[folder].problems(Path(folder), [shard])[shard]
