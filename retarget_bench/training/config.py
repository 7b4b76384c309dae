"""Training configs, which every method has, and budgets, which limit a run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import cos, pi
from typing import Any, Literal

from retarget_bench.errors import BenchError

Precision = Literal["float32", "bfloat16"]
Schedule = Literal["constant", "cosine", "triangular"]
_TRIED = 32
"""Frames of a window that every method learns from."""


@dataclass(frozen=True)
class Augmentation:
    """Other motion made of the windows that a batch draws, and other bodies. Shares of rows: ``exchanged``,
    ``turned``, ``mirrored``, ``warped``, ``veered``.

    exchanged: parts of the body (arms, legs, trunk, head, tail) move as in another row.
    turned:    some joints are turned about random axes, smoothly over time. joints: which share of them, a
               chain (a spine, a neck, a tail, a finger) being one. deviation: degrees, of the angle.
    mirrored:  left and right exchanged, on bodies whose sides are alike.
    warped:    at speeds that change smoothly. speed: the fastest; its inverse is the slowest.
    veered:    body and path turn about the vertical axis, smoothly over time. veer: degrees, the deviation.
    slant:     degrees: every body on two legs is there once more, ``reshaped``, with bones that slant by so
               much; 0: not.

    The lowest joint stays as high in every frame, and the root's path over the floor the same, unless it
    veers.
    """

    exchanged: float = 0.5
    turned: float = 0.6
    joints: float = 1 / 3
    deviation: float = 30.0
    mirrored: float = 0.5
    warped: float = 0.5
    speed: float = 1.4
    veered: float = 0.5
    veer: float = 30.0
    slant: float = 8.0


@dataclass(frozen=True)
class TrainingConfig:
    """One preset of a method. A budget on the command line replaces ``steps``.

    steps:     training steps; 0 on a card: a budget of time took their place.
    batch:     rows of a batch, over all processes together.
    window:    frames of a window, at ``fps``.
    rate:      learning rate, the highest of the schedule.
    schedule:  constant; cosine (down to a hundredth of the rate at the end of the budget); triangular
               (between ``lowest`` and ``rate``, up and down once in ``period`` steps).
    warm_up:   steps over which the rate rises from zero first.
    validate:  steps between validations, 0: only at the end. cases: validation cases of each split.
    precision: of matrix products while training (``bfloat16``: torch's autocast, where a method allows it).
    average:   decay, in a step, of the exponential average of the weights (``weight_average.py``), which is
               what is validated and exported; 0: the weights themselves are.
    augmentation: None: windows are as the clips have them.
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
    average: float = 0.0
    augmentation: Augmentation | None = None

    def rate_at(self, step: int, progress: float) -> float:
        """The learning rate of a step (from 0), when this share of the budget is used up."""
        warm = min((step + 1) / self.warm_up, 1.0) if self.warm_up else 1.0
        if self.schedule == "cosine":
            low = 0.01 * self.rate
            return warm * (low + (self.rate - low) * 0.5 * (1.0 + cos(pi * min(progress, 1.0))))
        if self.schedule == "triangular" and self.period:
            phase = (step % self.period) / self.period
            return warm * (self.lowest + (self.rate - self.lowest) * (1.0 - abs(2.0 * phase - 1.0)))
        return warm * self.rate


def on_gpu(default: TrainingConfig, precision: Precision = "float32") -> TrainingConfig:
    """A method's default for a GPU: 256 rows a batch, and validation every 300 steps, between which the
    loop leaves a minute at least. precision: bfloat16 makes some methods faster, and others slower."""
    return replace(default, batch=256, validate=300, precision=precision)


def for_a_try(default: TrainingConfig) -> TrainingConfig:
    """A method's default in twenty steps of a few short windows, to see that all works."""
    window, warm_up = min(default.window, _TRIED), min(default.warm_up, 5)
    return replace(default, steps=20, batch=4, window=window, warm_up=warm_up, validate=20, cases=2)


def presets(method: Any) -> Mapping[str, TrainingConfig]:
    """A method's own presets, and those that are made of its default: ``gpu`` and ``quick``."""
    own: Mapping[str, TrainingConfig] = method.presets
    if (default := own.get("default")) is None:
        return own
    return {"gpu": on_gpu(default), "quick": for_a_try(default), **own}


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
        match = _WRITTEN.fullmatch(text.strip().lower())
        number = float(match[1]) if match else 0.0
        if match and number * _UNITS.get(match[2], 1.0) >= LONGEST:
            raise BenchError(
                f"the budget {text[:20]}... is more than any training takes; give a smaller one"
            )
        if match is None or number <= 0 or (match[2] == "it" and number != int(number)):
            raise BenchError(
                f"{text!r} is no budget; write time as 90s, 30m, 2h or 1d, or steps as 20000it"
            )
        if match[2] == "it":
            return cls(steps=int(number))
        return cls(seconds=number * _UNITS[match[2]])

    def used(self, steps: int, seconds: float) -> float:
        """The share that is used up; 1 or more: the end."""
        return steps / self.steps if self.steps else seconds / self.seconds
