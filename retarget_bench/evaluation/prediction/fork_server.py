"""A process from which prediction workers are forked, so that each starts with everything imported.

It holds no data set, no reference and no method, and imports none: what it forks begins as empty as it is.
"""

import gc
import importlib
import json
import os
import signal
import socket
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import psutil

from retarget_bench.evaluation.prediction import answering
from retarget_bench.evaluation.prediction.launch import adopt_orphans, end_group, end_with_parent, ending


def main(descriptor: int, preload: Sequence[str]) -> None:
    """Fork workers as asked over a socket until it closes; then end them with all that they started."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the asking process decides
    adopt_orphans()
    for module in preload:
        with suppress(ImportError):
            importlib.import_module(module)
    gc.freeze()  # the memory of what is imported stays shared
    workers: dict[int, str] = {}
    with socket.socket(fileno=descriptor) as asking:
        while (received := _received(asking)) is not None:
            request, descriptors = received
            _reap(workers)
            if "start" in request:
                pid = _forked(asking, request["start"], descriptors)
                workers[pid] = ""
                reply: dict[str, Any] = {"pid": pid}
            else:
                reply = {"ended": workers.get(request["state"], "it is gone")}
            try:
                asking.sendall(json.dumps(reply).encode() + b"\n")
            except OSError:  # nobody waits for it any more
                break
    for pid in workers:
        end_group(pid)
    while left := psutil.Process().children(recursive=True):  # also what has left its worker's group
        for each in left:
            with suppress(psutil.Error):
                each.kill()
        with suppress(ChildProcessError):
            os.waitpid(-1, 0)  # so that their processor time counts as ours


def _received(asking: socket.socket) -> tuple[dict[str, Any], list[int]] | None:
    """A request and the file descriptors sent along; None where the asking process is gone."""
    text, descriptors = b"", list[int]()
    while not text.endswith(b"\n"):
        try:
            piece, attached, _, _ = socket.recv_fds(asking, 2**16, 2)
        except OSError:
            return None
        if not piece:
            return None
        text += piece
        descriptors += attached
    return json.loads(text), descriptors


def _forked(asking: socket.socket, start: Mapping[str, Any], descriptors: list[int]) -> int:
    server = os.getpid()
    pid = os.fork()
    if not pid:
        try:
            end_with_parent(server)
            asking.close()
            answering.begin(start, *descriptors)
        finally:
            os._exit(1)  # never back into the loop of the server
    for each in descriptors:
        os.close(each)
    return pid


def _reap(workers: dict[int, str]) -> None:
    """Reap processes that have ended, those left behind by workers included. workers: how each ended."""
    with suppress(ChildProcessError):
        while (dead := os.waitpid(-1, os.WNOHANG))[0]:
            pid, status = dead
            if pid in workers:
                workers[pid] = ending(os.waitstatus_to_exitcode(status))
