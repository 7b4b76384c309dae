"""A process of its own for every batch, forked from the loaded method and gone afterwards.

So an answer depends on its batch alone: what a method keeps of a question, in memory or in its folder, ends
with the process that was asked it. The worker that forks never asks the method anything itself.
"""

import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from pathlib import Path

from retarget_bench.evaluation.prediction.launch import children, end_group, end_with_parent, ending
from retarget_bench.evaluation.prediction.limits import FOLDER

FAREWELL = 0.5
"""Seconds in which Python's own helper may remove the shared memory that a method has left."""
_NUMBERS = count()


def possible() -> bool:
    """True where this process can be forked as it is: no other thread runs in it, and it uses no GPU."""
    if not hasattr(os, "pidfd_open") or len(list(Path("/proc/self/task").iterdir())) > 1:
        return False
    torch = sys.modules.get("torch")
    return torch is None or not torch.cuda.is_initialized()


def run_in_child(work: Callable[[], None], folder: Path, asking: int) -> str:
    """Do some work in a child in a folder of its own, and end it with all that it started and wrote.

    How it ended, in words; "" where it did the work. asking: a descriptor that hangs up when nobody
    waits for the work any more, at which this process ends, too.
    """
    place, process = folder / str(next(_NUMBERS)), os.getpid()
    pid = os.fork()
    if not pid:
        _child(work, place, process)
    code = _end_of(pid, asking)
    end_family(pid)
    if place.exists():
        shutil.rmtree(place, ignore_errors=True)
    return "" if code == 0 else ending(code)


def _child(work: Callable[[], None], place: Path, parent: int) -> None:
    """The child's part; never returns."""
    code, process = 1, os.getpid()
    try:
        end_with_parent(parent)
        os.setsid()  # whoever ends this process ends what it started
        place.mkdir()
        os.chdir(place)  # what a method writes or deletes by relative paths is its own
        os.environ["TMPDIR"] = tempfile.tempdir = str(place)
        resource.setrlimit(resource.RLIMIT_FSIZE, (FOLDER, FOLDER))
        work()
        code = 0
    finally:
        with suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code if os.getpid() == process else 0)


def _end_of(pid: int, asking: int) -> int:
    """The exit code of a child when it has ended; signals are negative."""
    ended = os.pidfd_open(pid)
    poll = select.poll()
    poll.register(ended, select.POLLIN)
    poll.register(asking, 0)  # hang-ups are told in any case
    try:
        if ended not in (descriptor for descriptor, _ in poll.poll()):
            end_family(pid)
            os._exit(1)
    finally:
        os.close(ended)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def end_family(pid: int) -> None:
    """Kill what a child of this process has started, which is this process's own when the child has ended.

    The process by which Python's multiprocessing removes shared memory that was left may do so first.
    """
    until = time.monotonic() + FAREWELL
    while left := _own_children():
        if overdue := time.monotonic() > until:
            end_group(pid)
        for each in left:
            if overdue or not _tidies(each):
                with suppress(OSError):
                    os.kill(each, signal.SIGKILL)
        with suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        if _own_children():
            time.sleep(0.005)


def _own_children() -> list[int]:
    """The living and dead children of this process; to go through all processes would take long."""
    pid = os.getpid()
    with suppress(OSError):
        return list(map(int, Path(f"/proc/self/task/{pid}/children").read_text().split()))
    return children(pid)


def _tidies(pid: int) -> bool:
    """True for the process by which Python's multiprocessing removes shared memory that was left."""
    try:
        return b"multiprocessing.resource_tracker" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False
