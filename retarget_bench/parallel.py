"""One function for many payloads, in processes of this machine."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from types import ModuleType
from typing import Any

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
DIED = "its process died (memory used up?)"


@dataclass(frozen=True)
class Done:
    """The function's result for one payload, or what went wrong with it.

    number: of the payload.
    """

    number: int
    result: Any = None
    error: str = ""


def carried_out(function: Callable[[Any], Any], payloads: Sequence[Any], jobs: int) -> Iterator[Done]:
    """One Done per payload, in the order in which they finish.

    function: of a module, which processes import by its name; payloads: plain data. A process has one
    thread. Where one dies, all that was not finished is begun again, each in a process of its own.
    """
    waiting: dict[Future[Any], int] = {}
    died: list[int] = []
    with _executor(max(1, min(jobs, len(payloads)))) as executor:
        with _without_main():
            for number, payload in enumerate(payloads):
                try:
                    waiting[executor.submit(function, payload)] = number
                except BrokenProcessPool:
                    died.append(number)
        for future in as_completed(waiting):
            done = _done(future, waiting[future])
            if done.error == DIED:
                died.append(done.number)
            else:
                yield done
    for number in sorted(died):
        with _executor(1) as executor, _without_main():
            yield _done(executor.submit(function, payloads[number]), number)


@contextmanager
def _executor(workers: int) -> Iterator[ProcessPoolExecutor]:
    """An executor whose processes end where it is left before its work is done."""
    executor = ProcessPoolExecutor(workers, get_context("spawn"), initializer=_begin)
    try:
        yield executor
    finally:
        if threading.current_thread() is threading.main_thread() and sys.exc_info()[0] is not None:
            for process in list((executor._processes or {}).values()):
                process.terminate()
        executor.shutdown(cancel_futures=True)


def _done(future: Future[Any], number: int) -> Done:
    try:
        return Done(number, future.result())
    except BrokenProcessPool:
        return Done(number, error=DIED)
    except (Exception, SystemExit) as error:
        return Done(number, error=f"{type(error).__name__}: {error}")


@contextmanager
def _without_main() -> Iterator[None]:
    """Processes that start in here do not run the user's script, which would start them again."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def one_thread() -> None:
    """Give one thread to the libraries that this process computes with; called before they are imported."""
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))


def _begin() -> None:
    """The first steps of a process, before it imports what computes: it has one thread, the parent decides
    about Ctrl-C, and it ends when the parent has ended."""
    one_thread()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
