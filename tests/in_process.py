"""Runs without other processes, for tests in which the process itself is not the point."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import pytest

from retarget_bench.api import Case, Context
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import plan, runner, shard_work, timing
from retarget_bench.evaluation.predict import Outcome, predict_all
from retarget_bench.parallel import Done
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import ResultPaths


class InThisProcess:
    """An engine that carries out each shard here."""

    def __init__(self, jobs: int = 1, check: bool = False) -> None:
        del jobs, check

    def __enter__(self) -> InThisProcess:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def run(self, folder: Path, numbers: Sequence[int], kind: str = "shard") -> Iterator[tuple[int, str]]:
        work = shard_work.ShardWork(folder, folder)
        try:
            for number in numbers:
                yield number, self._problem(work, {"kind": kind, "number": number})
        finally:
            work.close()

    def _problem(self, work: shard_work.ShardWork, asked: Mapping[str, Any]) -> str:
        try:
            work.do({**asked, "again": False, "without": []})
        except shard_work.CannotStore as error:
            raise BenchError(
                f"stopped: {error}. What was finished is kept; run again to continue"
            ) from error
        except Exception as error:
            return f"{type(error).__name__}: {error}"
        return ""


class AskedHere:
    """A prediction worker that asks its method here."""

    def __init__(self, method: Spec) -> None:
        self.method = method

    def ask(self, questions: Sequence[tuple[Case, Context]]) -> list[Outcome]:
        return predict_all(bound.method(self.method).built, *map(list, zip(*questions, strict=True)))

    def ask_alone(self, questions: Sequence[tuple[Case, Context]]) -> tuple[list[Outcome], float]:
        start = time.perf_counter()
        return self.ask(questions), time.perf_counter() - start


class PoolHere:
    """A pool of such workers."""

    def __init__(self, *_: object) -> None:
        self.folder = Path()

    def worker(self, method: Spec, learned: bool = False) -> AskedHere:
        del learned
        return AskedHere(method)

    def close(self) -> None:
        pass


@contextmanager
def without_processes() -> Iterator[None]:
    """Runs in here start no process, and know no plug-in from before, as a new process would not."""
    for module in (plan, bound, shard_work):
        for each in vars(module).values():
            if hasattr(each, "cache_clear"):
                each.cache_clear()
    with pytest.MonkeyPatch.context() as patch:
        _patch(patch)
        yield


@pytest.fixture
def in_process(request: pytest.FixtureRequest) -> Iterator[None]:
    """``without_processes``, but for tests that are marked ``processes``."""
    with nullcontext() if request.node.get_closest_marker("processes") else without_processes():
        yield


def run_here(run_plan: plan.Plan) -> list[ResultPaths]:
    """The results of a run without other processes."""
    with pytest.MonkeyPatch.context() as patch:
        _patch(patch)
        return runner.run(run_plan, lambda done, total: None)


def _patch(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(runner, "Local", InThisProcess)
    patch.setattr(shard_work, "WorkerPool", PoolHere)
    patch.setattr(timing, "ENOUGH_SECONDS", 0.0)  # speeds are not the point either


def carried_out_here(function: Callable[[Any], Any], payloads: Sequence[Any], jobs: int) -> Iterator[Done]:
    """``parallel.carried_out`` in this process, on copies of what others would be sent."""
    del jobs
    for number, payload in enumerate(payloads):
        try:
            yield Done(number, function(pickle.loads(pickle.dumps(payload))))
        except Exception as error:
            yield Done(number, error=f"{type(error).__name__}: {error}")
