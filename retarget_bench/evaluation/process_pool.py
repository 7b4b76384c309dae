"""A pool of local processes for many small jobs.

A job is a module's function and a payload of plain data; neither objects nor closures travel.
"""

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
Function = Callable[[Any], Any]
"""A function of a module; worker processes import it by its name."""


@dataclass(frozen=True)
class Done:
    """A finished job: the function's result, or what went wrong with it."""

    job: int
    result: Any = None
    error: str = ""


class LocalPool:
    """``workers`` spawned processes, one thread each. A worker that dies costs its job, not the run."""

    def __init__(self, workers: int) -> None:
        self.workers = max(1, workers)

    def run(self, function: Function, payloads: Sequence[Any]) -> Iterator[Done]:
        """One Done per payload, in the order in which they finish."""
        crew = [_Worker(function) for _ in range(min(self.workers, len(payloads)))]
        waiting = iter(enumerate(payloads))
        try:
            for worker in crew:
                worker.give(next(waiting))
            while busy := {worker.pipe: worker for worker in crew if worker.job is not None}:
                for pipe in wait(list(busy)):
                    worker = busy[pipe]  # type: ignore[index]
                    yield worker.take()
                    if (following := next(waiting, None)) is not None:
                        worker.give(following)
        finally:
            for worker in crew:
                worker.stop()


class _Worker:
    """One process and the pipe to it; replaced by a new process when it dies."""

    def __init__(self, function: Function) -> None:
        self.function = function
        self.job: int | None = None
        self._start()

    def _start(self) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
        os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
        try:
            self.process: SpawnProcess = context.Process(
                target=_serve, args=(theirs, self.function), daemon=True
            )
            with _deaf_to_interrupts():
                self.process.start()
        finally:
            for name, value in before.items():
                os.environ.pop(name) if value is None else os.environ.update({name: value})
        theirs.close()

    def give(self, job: tuple[int, Any]) -> None:
        self.job, payload = job
        with suppress(BrokenPipeError, ConnectionResetError):  # take() will see that it died
            self.pipe.send(payload)

    def take(self) -> Done:
        job = self.job
        assert job is not None
        self.job = None
        try:
            result, error = self.pipe.recv()
            return Done(job, result, error)
        except (EOFError, ConnectionResetError):
            self.process.join()
            how = self.process.exitcode or 0
            self.pipe.close()
            self._start()
            what = f"signal {signal.Signals(-how).name}" if how < 0 else f"exit code {how}"
            return Done(job, error=f"the worker process died ({what}; memory used up?)")

    def stop(self) -> None:
        if self.job is not None:
            self.process.terminate()
        self.pipe.close()  # an idle worker sees the end of its pipe and leaves
        self.process.join(timeout=5)


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Processes that start in here ignore Ctrl-C, also while they import: the parent decides."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may change what a signal does
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _serve(pipe: Connection, function: Function) -> None:
    """Loop of a worker process: payloads in, (result, error) out, until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    while True:
        try:
            payload = pipe.recv()
        except EOFError:
            return
        try:
            answer = (function(payload), "")
        except Exception as error:  # one job's fault must not end the others
            answer = (None, f"{type(error).__name__}: {error}")
        try:
            pipe.send(answer)
        except (BrokenPipeError, ConnectionResetError):
            return
