"""A process from which prediction workers are forked, so that each starts with everything imported.

It holds no data set, no reference and no method, and imports none: what it forks begins as empty as it is.
"""

import ctypes
import gc
import importlib
import json
import os
import signal
import socket
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import psutil

from retarget_bench.evaluation.prediction import starting


def main(descriptor: int, preload: Sequence[str]) -> None:
    """Fork workers as asked over a socket until it closes; then end them with all that they started."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the asking process decides
    _adopt()
    for module in preload:
        with suppress(ImportError):
            importlib.import_module(module)
    gc.freeze()  # the memory of what is imported stays shared
    living: set[int] = set()
    with socket.socket(fileno=descriptor) as asking:
        while (asked := _received(asking)) is not None:
            request, descriptors = asked
            if "start" in request:
                pid = _forked(asking, request["start"], descriptors)
                living.add(pid)
                reply: dict[str, Any] = {"pid": pid}
            else:
                reply = {"ended": _ended(request["state"], living)}
            try:
                asking.sendall(json.dumps(reply).encode() + b"\n")
            except OSError:  # nobody waits for it any more
                break
    for pid in living:
        end_group(pid)
    while left := psutil.Process().children(recursive=True):  # also what has left its worker's group
        for each in left:
            with suppress(psutil.Error):
                each.kill()
        with suppress(ChildProcessError):
            os.waitpid(-1, 0)  # so that their processor time counts as ours


def _adopt() -> None:
    """Become the parent of whatever workers leave behind, so that it is found; Linux alone has that."""
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(36, 1, 0, 0, 0)  # PR_SET_CHILD_SUBREAPER


def _received(asking: socket.socket) -> tuple[dict[str, Any], list[int]] | None:
    """A request and the file descriptors sent along; None where the asking process is gone."""
    text, descriptors = b"", list[int]()
    while not text.endswith(b"\n"):
        try:
            piece, found, _, _ = socket.recv_fds(asking, 2**16, 2)
        except OSError:
            return None
        if not piece:
            return None
        text += piece
        descriptors += found
    return json.loads(text), descriptors


def _forked(asking: socket.socket, start: Mapping[str, Any], descriptors: list[int]) -> int:
    pid = os.fork()
    if not pid:
        try:
            asking.close()
            starting.begin(start, *descriptors)
        finally:
            os._exit(1)  # never back into the loop of the template
    for each in descriptors:
        os.close(each)
    return pid


def _ended(pid: int, living: set[int]) -> str:
    """How a worker ended; "" while it lives."""
    if pid not in living:
        return "it is gone"
    found, status = os.waitpid(pid, os.WNOHANG)
    if not found:
        return ""
    living.discard(pid)
    return ending(os.waitstatus_to_exitcode(status))


def ending(code: int) -> str:
    """An exit code in words; signals are negative, as in ``subprocess``."""
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"


def end_group(pid: int) -> None:
    """Kill a worker and what it started, as far as that has not left its process group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, signal.SIGKILL)
