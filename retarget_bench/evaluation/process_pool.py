"""A pool of local processes for many small jobs.

A job is a module's function and a payload of plain data; neither objects nor closures travel.
"""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from types import ModuleType
from typing import Any, Self

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
    """``workers`` spawned processes, one thread each. A worker that dies costs its job, not the run; since
    somebody else may have killed it, the job is given to another one first.

    They start when jobs need them, and serve every run until the ``with`` block ends: what a process has
    imported and loaded for one run is there for the next.
    """

    def __init__(self, workers: int) -> None:
        self.workers = max(1, workers)
        self._crew: list[_Worker] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self._crew:
            worker.stop()
        self._crew.clear()

    def run(
        self, function: Function, payloads: Sequence[Any], workers: int | None = None
    ) -> Iterator[Done]:
        """One Done per payload, in the order in which they finish. workers: at most so many at once."""
        count = min(workers or self.workers, len(payloads))
        self._crew += [_Worker() for _ in range(len(self._crew), count)]
        crew, waiting = self._crew[:count], iter(enumerate(payloads))
        repeated: set[int] = set()
        try:
            for worker in crew:
                worker.give(function, *next(waiting))
            while busy := {worker.pipe: worker for worker in crew if worker.job is not None}:
                for pipe in wait(list(busy)):
                    worker = busy[pipe]  # type: ignore[index]
                    done = worker.take()
                    if worker.died and done.job not in repeated:
                        repeated.add(done.job)
                        worker.give(function, done.job, payloads[done.job])
                        continue
                    yield done
                    if (following := next(waiting, None)) is not None:
                        worker.give(function, *following)
        finally:
            for worker in [each for each in crew if each.job is not None]:
                worker.stop()
                self._crew.remove(worker)


class _Worker:
    """One process and the pipe to it; where it died, the next job gets a new process."""

    def __init__(self) -> None:
        self.job: int | None = None
        self._start()

    def _start(self) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
        os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
        try:
            self.process: SpawnProcess = context.Process(target=_serve, args=(theirs,), daemon=True)
            with _deaf_to_interrupts(), _without_main():
                self.process.start()
        finally:
            for name, value in before.items():
                os.environ.pop(name) if value is None else os.environ.update({name: value})
        theirs.close()
        self.died = False

    def give(self, function: Function, job: int, payload: Any) -> None:
        if self.died:
            self._start()
        self.job = job
        with suppress(BrokenPipeError, ConnectionResetError):  # take() will see that it died
            self.pipe.send((function, payload))

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
            self.died = True
            what = f"signal {signal.Signals(-how).name}" if how < 0 else f"exit code {how}"
            return Done(job, error=f"the worker process died ({what}; memory used up?)")

    def stop(self) -> None:
        if self.job is not None:
            self.process.terminate()
            self.job = None
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


@contextmanager
def _without_main() -> Iterator[None]:
    """Processes that start in here do not run the user's script, which would start them again: what they
    need they import by name."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _serve(pipe: Connection) -> None:
    """Loop of a worker process: (function, payload) in, (result, error) out, until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    threading.Thread(target=_end_with_parent, daemon=True).start()
    while True:
        try:
            function, payload = pipe.recv()
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


def _end_with_parent() -> None:
    """End this process, whatever it is at, when its parent has ended."""
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
