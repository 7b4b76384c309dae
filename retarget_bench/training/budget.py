"""How long a training run may take: so many steps, or so much time over all its resumptions."""

from __future__ import annotations

import re
from dataclasses import dataclass

from retarget_bench.errors import BenchError

_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
LONGEST = 2.0**53
"""No budget has so many steps or seconds, or more: these are counted as floating-point numbers too."""
_WRITTEN = re.compile(r"(\d+(?:\.\d+)?)\s*(s|m|h|d|it)")


@dataclass(frozen=True)
class Budget:
    """Steps, or seconds of training with validation and checkpoints; the other one is 0."""

    steps: int = 0
    seconds: float = 0.0

    @classmethod
    def parse(cls, text: str) -> Budget:
        """``30m``, ``2h``, ``1.5h``, ``90s``, ``20000it``. Raises BenchError."""
        found = _WRITTEN.fullmatch(text.strip().lower())
        number = float(found[1]) if found else 0.0
        if found and number * _UNITS.get(found[2], 1.0) >= LONGEST:
            raise BenchError(
                f"the budget {text[:20]}... is more than any training takes; give a smaller one"
            )
        if found is None or number <= 0 or (found[2] == "it" and number != int(number)):
            raise BenchError(
                f"{text!r} is no budget; write time as 90s, 30m, 2h or 1d, or steps as 20000it"
            )
        if found[2] == "it":
            return cls(steps=int(number))
        return cls(seconds=number * _UNITS[found[2]])

    def used(self, steps: int, seconds: float) -> float:
        """Which share is used up; 1 or more: the end."""
        return steps / self.steps if self.steps else seconds / self.seconds
