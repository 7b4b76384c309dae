"""Starting the processes that answer, and ending them with everything that they started."""

import ctypes
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any, Protocol

import psutil

from retarget_bench.evaluation.prediction.channel import Channel, Closed

MARK = "RETARGET_BENCH_WORKER"
"""Environment variable by which workers and what they start are known as long as they live: the scoring
process and a number."""
IMPORTING, ANSWERING, ENDING = 120.0, 10.0, 5.0
"""Seconds in which the fork server has imported what workers begin with, in which it answers from then on,
and in which it ends."""
PRELOAD = (
    "retarget_bench.evaluation.prediction.answering",
    "retarget_bench.motion.planting",
    "retarget_bench.motion.transfer",
    "importlib.metadata",
)
"""What all workers import, or nearly all."""
LEARNED = (
    "torch",
    "retarget_bench.training.learned_method",
    "retarget_bench.training.data",
    "retarget_bench.motion.aligned",
)
"""What those of methods with weights import, too."""
_NUMBERS = count()


class Started(Protocol):
    """A process that answers. ``ended``: how, in words; "" while it lives."""

    pid: int
    channel: Channel

    def ended(self) -> str: ...


class ForkServer:
    """The process that workers are forked from (``fork_server.py``), started when the first is asked for.

    preload: modules that they begin with.
    """

    def __init__(self, preload: Sequence[str], mark: str) -> None:
        here, there = socket.socketpair()
        code = (
            f"import sys; sys.path[:] = {sys.path!r}\n"
            "from retarget_bench.evaluation.prediction.fork_server import main\n"
            f"main({there.fileno()}, {list(preload)!r})"
        )
        self._socket, self._patience = here, IMPORTING
        self._channel = Channel(here.fileno(), here.fileno())
        self._process = subprocess.Popen(
            [sys.executable, "-c", code],
            stdin=subprocess.DEVNULL,
            pass_fds=[there.fileno()],
            start_new_session=True,
            env=os.environ | {MARK: mark},
        )
        there.close()

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def living(self) -> bool:
        return self._process.poll() is None

    def start(self, start: Mapping[str, Any]) -> "Forked":
        """A worker. Raises OSError where the server is gone or does not answer; it is ended then."""
        here, there = socket.socketpair()
        with there:
            pid = self.ask({"start": start}, [there.fileno(), there.fileno()])["pid"]
        descriptor = here.detach()
        return Forked(self, pid, Channel(descriptor, descriptor))

    def ask(self, request: Mapping[str, Any], descriptors: Sequence[int] = ()) -> dict[str, Any]:
        """Raises OSError where the server is gone or does not answer; it is ended then."""
        try:
            socket.send_fds(self._socket, [json.dumps(request).encode() + b"\n"], descriptors)
            if (reply := self._channel.receive(self._patience)) is None:
                raise OSError("the process that workers are forked from does not answer")
        except (OSError, Closed) as error:
            self._process.kill()
            with suppress(subprocess.TimeoutExpired):  # a signal takes a while, and no other server starts
                self._process.wait(timeout=ENDING)
            if isinstance(error, Closed):
                raise OSError("the process that workers are forked from is gone") from error
            raise
        self._patience = ANSWERING
        return reply

    def close(self) -> None:
        self._socket.close()  # it ends its workers, and itself
        try:
            self._process.wait(timeout=ENDING)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class Forked:
    """A worker that a fork server forked."""

    def __init__(self, server: ForkServer, pid: int, channel: Channel) -> None:
        self._server, self.pid, self.channel = server, pid, channel

    def ended(self) -> str:
        try:
            return str(self._server.ask({"state": self.pid})["ended"])
        except OSError:
            return "it is gone"


class Spawned:
    """A worker that is started by a command, and speaks over its standard input and output."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str], log: str, mark: str) -> None:
        with Path(log).open("ab") as errors:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                # unbuffered: what a method prints is in the log though its process be killed
                env={"PYTHONUNBUFFERED": "1", **environment, MARK: mark},
                start_new_session=True,
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self.pid = self._process.pid
        pipes = (self._process.stdout, self._process.stdin)
        self.channel = Channel(*(os.dup(each.fileno()) for each in pipes))
        for each in pipes:
            each.close()

    def ended(self) -> str:
        code = self._process.poll()
        return "" if code is None else ending(code)


# ---------------------------------------------------------------------------------------------- ending
def ending(code: int) -> str:
    """An exit code in words; signals are negative, as in ``subprocess``."""
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"


def end_group(pid: int) -> None:
    """Kill a process and what it started, as far as that has not left its process group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, signal.SIGKILL)


def end(started: Started) -> None:
    """Kill a process with its descendants, also those that have left its group."""
    family = _family(started.pid)
    if hasattr(os, "killpg"):
        end_group(started.pid)
    for each in family:
        with suppress(psutil.Error):
            each.kill()
    started.channel.close()
    started.ended()  # takes notice, so that no dead process stays in the system's list


def adopt_orphans() -> None:
    """Become the parent of what children leave behind, so that it is found; Linux alone has that."""
    _prctl(36, 1)  # PR_SET_CHILD_SUBREAPER


def end_with_parent(parent: int) -> None:
    """Have the system kill this process when its parent ends, however that ends; Linux alone has that."""
    _prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    if os.getppid() != parent:
        os._exit(1)


def _prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def new_mark() -> str:
    """The value of ``MARK`` for the workers of one pool."""
    return f"{os.getpid()}-{next(_NUMBERS)}"


def end_orphans(mark: str, workers: Sequence[int], servers: Sequence[int] = ()) -> None:
    """Kill what workers of this mark left behind.

    workers: those that may live, with what they started. servers: they live, what they started may not.
    """
    adopted = [child for server in servers for child in children(server)]
    for each in psutil.process_iter():
        with suppress(psutil.Error):
            if each.pid in (*workers, *servers):
                continue
            if each.pid not in adopted and each.environ().get(MARK) != mark:
                continue
            if not {parent.pid for parent in each.parents()} & set(workers):
                each.kill()


def children(pid: int) -> list[int]:
    """The processes that a process has started or taken over from those that ended."""
    with suppress(psutil.Error):
        return [each.pid for each in psutil.Process(pid).children()]
    return []


def memory_of(pids: Iterable[int]) -> int:
    """Bytes that processes and their descendants hold; what they share counts once, where the system
    tells."""
    return sum(_held(each) for pid in pids for each in _family(pid))


def _held(process: psutil.Process) -> int:
    try:
        for line in Path(f"/proc/{process.pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return int(line.split()[1]) * 1024
    except (OSError, ValueError):
        pass
    with suppress(psutil.Error):
        return int(process.memory_info().rss)
    return 0


def _family(pid: int) -> list[psutil.Process]:
    """A process, if it lives, after its descendants."""
    try:
        mother = psutil.Process(pid)
        return [*mother.children(recursive=True), mother]
    except psutil.Error:
        return []
