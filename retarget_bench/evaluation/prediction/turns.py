"""Locks by which the scoring processes of a machine ask methods together, or one of them alone."""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows, where nobody waits
    fcntl = None  # type: ignore[assignment]


class Turns:
    """Two lock files in a folder that the processes of a run share. The system lets go of what a
    process that ends has locked.

    A process that asks alone locks the gate first, so that no others begin while it waits for those that
    are asking.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._gate, self._asking = (
            os.open(folder / name, os.O_RDWR | os.O_CREAT, 0o600) for name in ("gate.lock", "asking.lock")
        )

    @contextmanager
    def together(self) -> Iterator[None]:
        """While others may ask, too."""
        with ExitStack() as asking:
            with _held(self._gate, alone=False):
                asking.enter_context(_held(self._asking, alone=False))
            yield

    @contextmanager
    def alone(self) -> Iterator[None]:
        """While nobody else asks."""
        with _held(self._gate, alone=True), _held(self._asking, alone=True):
            yield

    def close(self) -> None:
        for each in (self._gate, self._asking):
            with suppress(OSError):
                os.close(each)


@contextmanager
def _held(lock: int, *, alone: bool) -> Iterator[None]:
    if fcntl is not None:
        fcntl.flock(lock, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
    try:
        yield
    finally:
        if fcntl is not None:
            fcntl.flock(lock, fcntl.LOCK_UN)
