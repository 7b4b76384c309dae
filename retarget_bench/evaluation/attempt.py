"""Calls of metrics and data sets with a time limit; every fault of theirs becomes a sentence."""

import signal
import threading
import time
from collections import Counter
from collections.abc import Callable
from typing import Never, TypeVar

from retarget_bench.errors import BenchError, one_line
from retarget_bench.evaluation.prediction.limits import text

T = TypeVar("T")
PATIENCE = 3
"""So often in a row, and what does not answer in time is asked no more."""
AGAIN = 1.0
"""Seconds after which a call that went on all the same is interrupted anew."""
GRACE = 10.0
"""Seconds after its limit in which a call that Python can interrupt has ended."""
_late_times = Counter[str]()
_ends = [float("inf")]
"""When the call that is going on should have ended, by the monotonic clock."""


class Fault(BenchError):
    """A fault that a plug-in did not report itself."""


class _Late(BaseException):
    """Raised in a call whose time is over; no ``Exception``, which plug-ins catch."""


def attempt(ask: Callable[[], T], seconds: float, name: str) -> T:
    """Call a plug-in within a time limit. Raises its own BenchError, and Fault for any other end.

    name: of what is asked, which is asked no more in this process after it was late ``PATIENCE`` times in a
    row. A call can be interrupted in the first thread of a process alone, and while it runs Python; see
    ``overdue`` for others.
    """
    times = 0
    if _late_times[name] >= PATIENCE:
        raise Fault(f"no answer in time, {PATIENCE} times in a row; it was asked no more")
    try:
        return _within(seconds, lambda: _faulted(ask))
    except _Late:
        times = _late_times[name] + 1
        raise Fault(f"no answer within {seconds:g} s") from None
    finally:
        _late_times[name] = times


def sentence(error: BaseException) -> str:
    """An error of a plug-in in a line: its own words where they are meant for people."""
    return text(error if isinstance(error, BenchError) else one_line(error))


def kind(value: object) -> str:
    """The type of a wrong value of a plug-in, in words."""
    return f"an object of type {type(value).__name__}"


def overdue() -> bool:
    """Whether a call should have been interrupted and was not: it hangs outside of Python."""
    return time.monotonic() > _ends[0] + GRACE


def _faulted(ask: Callable[[], T]) -> T:
    try:
        return ask()
    except (BenchError, KeyboardInterrupt, _Late):
        raise
    except BaseException as error:  # SystemExit, too
        raise Fault(sentence(error)) from error


def _within(seconds: float, ask: Callable[[], T]) -> T:
    """Raises _Late."""
    if threading.current_thread() is not threading.main_thread():
        return ask()
    before = signal.signal(signal.SIGALRM, _interrupt)
    try:
        try:
            _ends[0] = time.monotonic() + seconds
            signal.setitimer(signal.ITIMER_REAL, seconds, AGAIN)
            return ask()
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
    finally:  # once more, since the alarm may have come in the line above
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        _ends[0] = float("inf")
        signal.signal(signal.SIGALRM, before)


def _interrupt(*_: object) -> Never:
    raise _Late
