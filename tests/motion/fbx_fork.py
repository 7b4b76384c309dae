"""Reading FBX files in a copy of a process that has NumPy and ufbx already: it need not start anew."""

from __future__ import annotations

import os
import signal
import subprocess
import time

import ufbx  # noqa: F401  (copies have it)

from retarget_bench.motion.files.fbx import child

_POLLED = 0.001


def process(arguments: list[str], seconds: float) -> tuple[int, str]:
    """As ``content.process``, in a copy of this process; memory is limited as that of this process is."""
    if not (pid := os.fork()):
        try:
            child.limit(-1, int(seconds) + 1)
            child.answer(*map(child.Path, arguments[:2]), arguments[2])
        finally:
            os._exit(0)
    end = time.monotonic() + seconds
    while True:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status), ""
        if time.monotonic() > end:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            raise subprocess.TimeoutExpired("a copy of this process", seconds)
        time.sleep(_POLLED)
