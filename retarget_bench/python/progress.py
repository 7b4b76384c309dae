"""Progress of long work: a bar on terminals and in notebooks, a line a minute elsewhere."""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from retarget_bench.viewer.scene_builder import Over

SECONDS = 60.0
"""Between two lines."""
QUICK = 2.0
"""Seconds of work in steps of which no line is said."""


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


@contextmanager
def stepped(what: str, shown: bool = True) -> Iterator[Over]:
    """The same of work in several loops, whose lengths are found on the way; gives a function that goes
    over the items of one."""
    done = total = 0
    start = time.monotonic()
    with progress_bar(what, "steps", shown) as progress:

        def over(items: Collection[Any]) -> Iterator[Any]:
            nonlocal done, total
            total += len(items)
            end = done + len(items)
            try:
                for each in items:
                    progress(done, total)
                    yield each
                    done += 1
            finally:
                done = end  # also where the loop was left

        yield over
        if total and time.monotonic() - start > QUICK:
            progress(total, total)


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
