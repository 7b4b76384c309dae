"""Specs as people write them, with files of plug-ins for names: ``my_method.py[k=2]+my_post.py``.

The first import of a file is made in a process of its own, so that code at the level of a module that
hangs, or ends the process it is in, costs no command.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from os import PathLike
from pathlib import Path

from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import cache_folder, digest, write_text
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec

LONGEST = 120.0
"""Seconds that an import may take; torch takes three."""
_FILE = re.compile(r"(?:^|(?<=\+))[^\[\]+@'\"]+\.py(?=[\[+@]|$)")
_IMPORTED = 77
"""Exit code of a process in which the import came to an end."""
_IMPORT = f"""
import sys
from contextlib import suppress
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
with suppress(BenchError):
    registry.add_file(sys.argv[1])
sys.exit({_IMPORTED})
"""


def parse(text: str | Spec) -> Spec:
    """The spec of a text, whose files are added to the registry. Raises BenchError for one that is no
    plug-in."""
    return text if isinstance(text, Spec) else Spec.parse(with_names(text))


def dataset(text: str, root: str | PathLike[str] | None = None) -> Spec:
    """The data set that a name and a folder of its files mean together; the folder wins."""
    spec = parse(text)
    return spec if root is None else spec.with_parameters(root=str(root))


def with_names(text: str) -> str:
    """A text with the names of plug-ins in place of their files, which are added to the registry."""
    return _FILE.sub(lambda file: add_file(file[0]).name, text.strip())


def written(spec: Spec, places: bool = True) -> str:
    """The text that ``parse`` reads as this spec, also in a process that does not know its files yet.

    places: with where these files lie, else by their names alone."""
    files = {Path(path).stem: path if places else Path(path).name for path, _ in registry.files()}
    parts = [(spec.alone if not spec.environment else replace(spec, posts=())), *spec.posts]
    return "+".join(files.get(each.name, each.name) + str(each).removeprefix(each.name) for each in parts)


def add_file(path: str | PathLike[str]) -> registry.PluginEntry:
    """``registry.add_file``, after an import elsewhere. Raises BenchError."""
    path = Path(path)
    path = path.parent if path.name == "__init__.py" else path
    try_import(path)
    return registry.add_file(path)


def _end(process: subprocess.Popen[bytes]) -> None:
    """Kill a process, if it lives, and what it started."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()


def try_import(path: Path) -> None:
    """Import a plug-in file elsewhere, once for each state of its code.

    Raises BenchError where importing it ends the process, or takes longer than ``LONGEST`` seconds. Errors
    of the plug-in itself are left to the import here.
    """
    if not registry.file_of(path).is_file():
        return
    mark = (
        cache_folder()
        / "plugins"
        / digest(f"{sys.version}\0{registry.file_entry(path.resolve()).module}", 24)
    )
    if mark.exists():
        return
    command, nothing = [sys.executable, "-c", _IMPORT, str(path)], subprocess.DEVNULL
    with subprocess.Popen(
        command, stdin=nothing, stdout=nothing, stderr=nothing, start_new_session=True
    ) as importing:
        try:
            code = importing.wait(LONGEST)
        except subprocess.TimeoutExpired:
            raise BenchError(
                f"{path}: importing it takes more than {LONGEST:g} s; nothing was run"
            ) from None
        finally:
            _end(importing)
    if code != _IMPORTED:
        raise BenchError(
            f"{path}: importing it ends the process that does (exit code {code}); nothing was run"
        )
    with suppress(FileError):  # a cache that cannot be written: it is tried again the next time
        write_text(mark, "")
