"""Progress of long work: a bar on terminals and in notebooks, a line a minute elsewhere."""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SECONDS = 60.0
"""Between two lines."""


@contextmanager
def progress_bar(what: str, units: str, shown: bool = True) -> Iterator[Callable[[int, int], None]]:
    """A bar in notebooks and on a terminal that has a size, else lines on the error output; gives a
    function of how much is done, and of how much in all."""
    if not shown:
        yield _unseen
    elif "ipykernel" not in sys.modules and not _has_size():
        yield _Lines(what, units)
    else:
        from tqdm import TqdmWarning

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TqdmWarning)  # notebooks without widgets get a bar of text
            from tqdm.auto import tqdm

            bar = tqdm(desc=what, unit=f" {units}", leave=False)
        with bar:

            def progress(done: int, total: int) -> None:
                bar.total = total
                bar.update(done - bar.n)

            yield progress


def _has_size() -> bool:
    """True for a terminal that reports its width; a bar would be empty on another."""
    try:
        return sys.stderr.isatty() and os.get_terminal_size(sys.stderr.fileno()).columns > 0
    except OSError:
        return False


def _unseen(done: int, total: int) -> None:
    del done, total


class _Lines:
    """Progress as lines on the error output: one in ``SECONDS`` at most, and one when all is done."""

    def __init__(self, what: str, units: str) -> None:
        self.what, self.units = what, units
        self.start = self.printed = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        now = time.monotonic()
        if not done or (now - self.printed < SECONDS and done < total):
            return
        self.printed = now
        spent = (now - self.start) / 60
        remaining = f", about {spent * (total - done) / done:.1f} min left" if done >= total / 20 else ""
        remaining = f" in {spent:.1f} min" if done >= total else remaining
        print(f"{self.what}: {done} of {total} {self.units}{remaining}", file=sys.stderr, flush=True)
