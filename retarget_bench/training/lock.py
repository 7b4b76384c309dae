"""One process at a time trains in a folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from retarget_bench.errors import BenchError, FileError

try:
    import fcntl
except ImportError:  # Windows: nothing is locked there
    fcntl = None  # type: ignore[assignment]

NAME = ".lock"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """The folder, made where there is none, for this process alone; made in vain, it is removed again.

    The system lets go of the lock when the process ends, however it ends. Raises BenchError where another
    process has it, FileError where the folder cannot be written.
    """
    if fcntl is None:
        yield
        return
    made = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        file = _taken(folder)
        try:
            yield
        finally:
            # while it is still locked, or the next process's lock would be removed
            (folder / NAME).unlink(missing_ok=True)
            os.close(file)
    finally:
        with suppress(OSError):  # not empty
            for each in made:
                each.rmdir()


def _taken(folder: Path) -> int:
    """The lock's file, open. It is tried again where whoever had it removed it just now."""
    path = folder / NAME
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise FileError(path, f"cannot be written ({error.strerror or error})") from error
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            os.close(file)
            raise BenchError(f"another process is training in {folder}") from error
        except OSError:  # a file system that has no locks
            return file
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file), path.stat()):
                return file
        os.close(file)
