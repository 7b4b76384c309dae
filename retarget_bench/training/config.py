"""How long and how fast a method is trained: everything that no method has to define for itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Precision = Literal["float32", "bfloat16"]
Schedule = Literal["constant", "cosine", "triangular"]


@dataclass(frozen=True)
class TrainingConfig:
    """One preset of a method. A budget on the command line replaces ``steps``.

    steps:     training steps.
    batch:     rows of a batch, over all processes together.
    window:    frames of a window, at ``fps``.
    rate:      learning rate, the highest of the schedule.
    schedule:  constant; cosine (down to a hundredth of the rate at the end of the budget); triangular
               (between ``lowest`` and ``rate``, up and down once in ``period`` steps).
    warm_up:   steps over which the rate rises from zero first.
    validate:  steps between validations, 0: only at the end. cases: validation cases of each split.
    precision: of matrix products while training (``bfloat16``: torch's autocast, where a method allows it).
    """

    steps: int
    batch: int
    window: int
    rate: float
    fps: float = 30.0
    schedule: Schedule = "constant"
    lowest: float = 0.0
    period: int = 0
    warm_up: int = 0
    validate: int = 500
    cases: int = 12
    precision: Precision = "float32"

    def rate_at(self, step: int, progress: float) -> float:
        """The learning rate of a step (from 0), when this share of the budget is used up."""
        from math import cos, pi

        warm = min((step + 1) / self.warm_up, 1.0) if self.warm_up else 1.0
        if self.schedule == "cosine":
            low = 0.01 * self.rate
            return warm * (low + (self.rate - low) * 0.5 * (1.0 + cos(pi * min(progress, 1.0))))
        if self.schedule == "triangular" and self.period:
            phase = (step % self.period) / self.period
            return warm * (self.lowest + (self.rate - self.lowest) * (1.0 - abs(2.0 * phase - 1.0)))
        return warm * self.rate
