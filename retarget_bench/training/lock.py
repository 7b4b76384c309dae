"""Lock of a training folder, for one process at a time."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from retarget_bench.errors import BenchError, FileError

NAME = ".lock"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """The folder, made where there is none, for this process alone; made in vain, it is removed again.

    The system lets go of the lock when the process ends, however it ends. Raises BenchError where another
    process has it, FileError where the folder cannot be written.
    """
    made = [each for each in (folder, *folder.parents) if not each.exists()]
    lock = FileLock(folder / NAME)
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock.acquire(timeout=0)
        except Timeout as error:
            raise BenchError(f"another process is training in {folder}") from error
        except OSError as error:
            raise FileError(folder / NAME, f"cannot be written ({error.strerror or error})") from error
        try:
            yield
        finally:
            # while it is still locked, or the next process's lock would be removed
            with suppress(OSError):  # Windows removes no open file
                (folder / NAME).unlink(missing_ok=True)
            lock.release()
    finally:
        with suppress(OSError):  # not empty
            for each in made:
                each.rmdir()
