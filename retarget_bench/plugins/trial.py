"""The first import of a plug-in file is made in a process of its own, so that code at the level of a module
that hangs, or ends the process it is in, costs no command."""

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import cache_folder, digest, write_text
from retarget_bench.plugins.own_files import own_files

LONGEST = 120.0
"""Seconds that an import may take; torch takes three."""
_DONE = "imported"
_CODE = """
import sys
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
said, sys.stdout = sys.stdout, sys.stderr
try:
    registry.add_file(sys.argv[1])
except BenchError:
    pass
said.write("imported")
said.flush()
"""


def try_import(path: str | Path) -> None:
    """Import a plug-in file elsewhere, once for each state of its code.

    What it raises is left to the import here, which tells it. Raises BenchError where importing it ends the
    process, or takes longer than ``LONGEST`` seconds.
    """
    file = Path(path, "__init__.py") if Path(path).is_dir() else Path(path)
    if not file.is_file():
        return
    code = "".join(f"{name}\0{each.read_bytes()!r}" for name, each in own_files(file.resolve()))
    mark = cache_folder() / "plugins" / digest(f"{sys.version}\0{code}", 24)
    if mark.exists():
        return
    with subprocess.Popen(
        [sys.executable, "-c", _CODE, str(path)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    ) as importing:
        try:
            said = importing.communicate(timeout=LONGEST)[0].decode(errors="replace")
        except subprocess.TimeoutExpired:
            raise BenchError(
                f"{path}: importing it takes more than {LONGEST:g} s; nothing was run"
            ) from None
        finally:
            _end(importing)
    if not said.endswith(_DONE):
        how = importing.returncode
        raise BenchError(
            f"{path}: importing it ends the process that does (exit code {how}); nothing was run"
        )
    with suppress(FileError):  # a cache that cannot be written: it is tried again the next time
        write_text(mark, "")


def _end(importing: "subprocess.Popen[bytes]") -> None:
    """Kill a process, if it lives, and what it started."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(importing.pid, signal.SIGKILL)
    importing.kill()
