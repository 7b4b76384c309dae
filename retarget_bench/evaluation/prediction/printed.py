"""What a method prints: to a file of its own, and from there to a log of limited length."""

import os
from contextlib import suppress
from pathlib import Path

from retarget_bench.evaluation.prediction.limits import LONGEST_LOG


class Printed:
    """The file that the process of a method prints to."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def keep(self, log: Path | None, least: int = 0) -> None:
        """Bring what was printed to the log, up to its limit, where it is more than the least; None: it
        is forgotten."""
        with suppress(OSError):
            if (length := self.path.stat().st_size) <= least:
                return
            kept = log.stat().st_size if log is not None and log.exists() else 0
            if log is not None and kept < LONGEST_LOG:
                log.parent.mkdir(parents=True, exist_ok=True)
                with self.path.open("rb") as printed, log.open("ab") as to:
                    to.write(printed.read(LONGEST_LOG - kept))
                    if length > LONGEST_LOG - kept:
                        to.write(b"\n... what came after this is not kept\n")
            os.truncate(self.path, 0)
