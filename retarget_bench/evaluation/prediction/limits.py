"""Limits of a method and of its answers: time, memory, disk, prints, messages, files."""

import os
import shlex
import stat
import zipfile
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from shutil import rmtree
from tempfile import gettempdir
from typing import Any

from retarget_bench.api import Case
from retarget_bench.errors import BenchError, FileError, printable
from retarget_bench.files import SCRATCH

STARTING = 180.0
"""Seconds in which a method must be built: weights are read, large packages are imported."""
BASE, PER_FRAME = 60.0, 1.0
"""Seconds for a case where no limit is given, and for each of its frames."""
PATIENCE = 3
"""So many cases without an answer in time, one after the other, and a method is asked no more."""
POLL = 0.1
"""Seconds between two checks of what a process that is answering takes."""
FOLDER = 2**30
"""Bytes of the files that a method may have in its folder."""
LONGEST_LOG = 2**20
"""Bytes that are kept of what a method prints in a run."""
LONGEST_MESSAGE = 1000
"""Characters of a reason."""
BWRAP = (
    *("bwrap", "--ro-bind", "/", "/", "--dev", "/dev", "--proc", "/proc"),
    *("--unshare-pid", "--unshare-ipc", "--unshare-net", "--die-with-parent"),
)
"""All files to read and none to write, no other processes, no network, no shared memory of others."""


@dataclass(frozen=True)
class Limits:
    """timeout: seconds for a case; 0: ``BASE`` and ``PER_FRAME``. memory: bytes of a worker; 0: none.
    isolate: words before the command that starts a worker; ``bwrap`` alone stands for ``BWRAP``."""

    timeout: float = 0.0
    memory: int = 0
    isolate: str = ""

    def prefix(self, folder: Path) -> list[str]:
        """The words before a worker's command. folder: what it has to be able to write to."""
        words = shlex.split(self.isolate)
        if words != ["bwrap"]:
            return words
        prefix = list(BWRAP)
        for place in sorted({"/tmp", gettempdir()}):  # its own, with what lies there to read
            prefix += ["--tmpfs", place]
            for each in sorted(Path(place).glob("*")):
                if not each.name.startswith(SCRATCH):
                    prefix += ["--ro-bind-try", str(each), str(each)]
        return [*prefix, "--bind", str(folder), str(folder)]

    def seconds(self, cases: Sequence[Case]) -> float:
        return sum(self.timeout or BASE + PER_FRAME * case.source.frames for case in cases)


class Trouble(BenchError):
    """A worker that did not answer. Each kind says what follows from it."""


class Beyond(Trouble):
    """A limit that would be passed again: time, memory, disk, or an answer that makes no sense."""


class Late(Beyond):
    """No answer in time."""


class Disturbed(Trouble):
    """The process ended or its files were changed, perhaps by another method: it is asked again, alone."""


class CannotStart(Trouble):
    """There is no process to ask. That is no answer: the cases are missing, and a later run asks again."""


def text(message: Any) -> str:
    """A reason as it can be written: not too long, and of characters that can be shown."""
    return printable(str(message)[:LONGEST_MESSAGE])


def keep_printed(printed: Path, log: Path | None, least: int = 0) -> None:
    """Move what a method printed to a log, up to ``LONGEST_LOG``, where it is more than the least; None: it
    is forgotten."""
    with suppress(OSError):
        if (length := printed.stat().st_size) <= least:
            return
        room = LONGEST_LOG - (log.stat().st_size if log is not None and log.exists() else 0)
        if log is not None and room > 0:
            log.parent.mkdir(parents=True, exist_ok=True)
            with printed.open("rb") as source, log.open("ab") as target:
                target.write(source.read(room))
                if length > room:
                    target.write(b"\n... what came after this is not kept\n")
        os.truncate(printed, 0)


def size_of(folder: Path) -> int:
    """Bytes of the files in a folder, however deep; those that cannot be seen do not count."""
    total, folders = 0, [str(folder)]
    while folders:
        with suppress(OSError), os.scandir(folders.pop()) as entries:
            for each in entries:
                with suppress(OSError):
                    if each.is_dir(follow_symlinks=False):
                        folders.append(each.path)
                    else:
                        total += each.stat(follow_symlinks=False).st_blocks * 512
    return total


def only(folder: Path, kept: Collection[str]) -> bool:
    """Remove everything from a folder but entries of these names; whether nothing else is left."""
    with suppress(OSError):
        for each in [each for each in folder.iterdir() if each.name not in kept]:
            if each.is_dir() and not each.is_symlink():
                rmtree(each, ignore_errors=True)
            else:
                each.unlink()
        return all(each.name in kept for each in folder.iterdir())
    return False


def check_file(path: Path, case: Case) -> None:
    """Raises FileError for anything but an ordinary file of about the size of an answer."""
    try:
        status = path.lstat()
    except OSError:
        raise FileError(path, "is not there, although the method's process says so") from None
    if not stat.S_ISREG(status.st_mode):
        raise FileError(path, "is not an ordinary file")
    try:
        with zipfile.ZipFile(path) as packed:
            size = sum(each.file_size for each in packed.infolist())
            rows = 4 * len(case.target.skeleton)
            if "vertices.npy" in packed.namelist() and case.target.mesh is not None:
                rows = len(case.target.mesh.vertices)
    except (OSError, zipfile.BadZipFile) as error:
        raise FileError(path, f"is not a readable .npz file ({error})") from error
    most = 16 * max(case.source.frames, 1) * rows + 2**16
    if max(size, status.st_size) > most:
        raise FileError(path, f"holds {size} bytes; {most} are plenty for {case.source.frames} frames")
