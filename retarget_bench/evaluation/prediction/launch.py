"""Starting the processes that answer, and ending them with everything that they started."""

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any, Protocol

import psutil

from retarget_bench.evaluation.prediction.channel import Channel
from retarget_bench.evaluation.prediction.template import end_group, ending

MARK = "RETARGET_BENCH_WORKER"
"""Environment variable by which workers and what they start are known as long as they live: the scoring
process and a number."""
_NUMBERS = count()


class Started(Protocol):
    """A process that answers. ``ended``: how, in words; "" while it lives."""

    pid: int
    channel: Channel

    def ended(self) -> str: ...


class Template:
    """The process that workers are forked from (``template.py``), started when the first is asked for.

    preload: modules that they begin with.
    """

    def __init__(self, preload: Sequence[str], mark: str) -> None:
        mine, theirs = socket.socketpair()
        code = (
            f"import sys; sys.path[:] = {sys.path!r}\n"
            "from retarget_bench.evaluation.prediction.template import main\n"
            f"main({theirs.fileno()}, {list(preload)!r})"
        )
        self._socket = mine
        self._process = subprocess.Popen(
            [sys.executable, "-c", code],
            stdin=subprocess.DEVNULL,
            pass_fds=[theirs.fileno()],
            start_new_session=True,
            env=os.environ | {MARK: mark},
        )
        theirs.close()

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def living(self) -> bool:
        return self._process.poll() is None

    def start(self, start: Mapping[str, Any]) -> "Forked":
        """A worker. Raises OSError where the template is gone."""
        ours, theirs = socket.socketpair()
        with theirs:
            pid = self.ask({"start": start}, [theirs.fileno(), theirs.fileno()])["pid"]
        descriptor = ours.detach()
        return Forked(self, pid, Channel(descriptor, descriptor))

    def ask(self, request: Mapping[str, Any], descriptors: Sequence[int] = ()) -> dict[str, Any]:
        socket.send_fds(self._socket, [json.dumps(request).encode() + b"\n"], descriptors)
        text = b""
        while not text.endswith(b"\n"):
            piece = self._socket.recv(2**16)
            if not piece:
                raise OSError("the process that workers are forked from is gone")
            text += piece
        return dict(json.loads(text))

    def close(self) -> None:
        self._socket.close()  # it ends its workers, and itself
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class Forked:
    """A worker that a template forked."""

    def __init__(self, template: Template, pid: int, channel: Channel) -> None:
        self._template, self.pid, self.channel = template, pid, channel

    def ended(self) -> str:
        try:
            return str(self._template.ask({"state": self.pid})["ended"])
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
                env={**environment, MARK: mark},
                start_new_session=True,
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self.pid = self._process.pid
        mine = (self._process.stdout, self._process.stdin)
        self.channel = Channel(*(os.dup(each.fileno()) for each in mine))
        for each in mine:
            each.close()

    def ended(self) -> str:
        code = self._process.poll()
        return "" if code is None else ending(code)


def end(started: Started) -> None:
    """Kill a process with its descendants, also those that have left its group."""
    try:
        family = psutil.Process(started.pid).children(recursive=True)
    except psutil.Error:
        family = []
    if hasattr(os, "killpg"):
        end_group(started.pid)
    with suppress(psutil.Error):
        family.append(psutil.Process(started.pid))
    for each in family:
        with suppress(psutil.Error):
            each.kill()
    started.channel.close()
    started.ended()  # takes notice, so that no dead process stays in the system's list


def new_mark() -> str:
    """The value of ``MARK`` for the workers of one crew."""
    return f"{os.getpid()}-{next(_NUMBERS)}"


def end_orphans(mark: str, workers: Sequence[int], template: int = 0) -> None:
    """Kill what workers of this mark left behind.

    workers: those that may live, with what they started. template: it lives, what it started may not.
    """
    adopted = children(template) if template else []
    for each in psutil.process_iter():
        with suppress(psutil.Error):
            if each.pid in (*workers, template):
                continue
            if each.pid not in adopted and each.environ().get(MARK) != mark:
                continue
            if not {parent.pid for parent in each.parents()} & set(workers):
                each.kill()


def children(pid: int) -> list[int]:
    """The processes that a process has started or, as a template does, taken over from those that ended."""
    with suppress(psutil.Error):
        return [each.pid for each in psutil.Process(pid).children()]
    return []


def memory_of(pids: Iterable[int]) -> int:
    """Bytes that processes and their descendants hold."""
    total = 0
    for pid in pids:
        with suppress(psutil.Error):
            process = psutil.Process(pid)
            for each in [process, *process.children(recursive=True)]:
                total += each.memory_info().rss
    return total
