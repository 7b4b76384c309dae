"""Runs without worker processes, for tests in which the process itself is not the point."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import pytest

from retarget_bench.api import Case, Context
from retarget_bench.evaluation import plan, runner, timing, worker
from retarget_bench.evaluation.predict import Outcome, predict_all
from retarget_bench.evaluation.process_pool import Done
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import ResultPaths


class InThisProcess:
    """An executor that does each job here, on a copy of what a worker would be sent."""

    def __init__(self, workers: int = 1) -> None:
        del workers

    def __enter__(self) -> InThisProcess:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def run(
        self, function: Callable[[Any], Any], payloads: Sequence[Any], workers: int | None = None
    ) -> Iterator[Done]:
        del workers
        for number, payload in enumerate(payloads):
            try:
                yield Done(number, function(pickle.loads(pickle.dumps(payload))))
            except Exception as error:
                yield Done(number, error=f"{type(error).__name__}: {error}")


class AskedHere:
    """A prediction worker that asks its method here."""

    def __init__(self, plan_: plan.Plan, method: Spec, scratch: Path, preload: Sequence[str]) -> None:
        del plan_, scratch, preload
        self.method, self.seconds = method, 0.0

    def ask(self, asked: Sequence[tuple[Case, Context]], repeat: int = 1) -> list[Outcome]:
        start = time.perf_counter()
        for _ in range(repeat):
            found = predict_all(plan.method(self.method), *map(list, zip(*asked, strict=True)))
        self.seconds = (time.perf_counter() - start) / repeat / len(asked)
        return found


@contextmanager
def without_processes() -> Iterator[None]:
    """Runs in here start no process, and know no plug-in from before, as a new process would not."""
    for module in (plan, worker):
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


def run_here(wanted: plan.Plan) -> list[ResultPaths]:
    """The results of a run without worker processes."""
    with pytest.MonkeyPatch.context() as patch:
        _patch(patch)
        return runner.run(wanted, lambda done, total: None)


def _patch(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(runner, "LocalPool", InThisProcess)
    for module in (worker, timing):
        patch.setattr(module, "prediction_worker", AskedHere)
