"""Random numbers that are the same on every machine and with every NumPy version."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")


class Stream:
    """An endless row of random numbers that belongs to a name.

    Raw Philox-4x64-10 bits are fixed by its publication (Salmon et al. 2011) and by NumPy's promise for
    bit generators; NumPy's *distributions* carry no such promise, so the transforms are our own. Each
    stream is keyed by a hash of its name: drawing from one never moves another.

    person: names the stream that personal style is drawn from; nothing: this one.
    """

    def __init__(self, *name: str | int, person: str = "") -> None:
        self.name, self.person = "/".join(str(part) for part in name), person
        key = int.from_bytes(hashlib.sha256(self.name.encode()).digest()[:16], "big")
        self._bits = np.random.Philox(key=key)

    def part(self, *name: str | int) -> Stream:
        """The stream of a part of what this one is for; the same person throughout."""
        return Stream(self.name, *name, person=self.person or f"{self.name}/person")

    def _units(self, count: int) -> list[float]:
        """``count`` numbers in [0, 1) with 53 random bits."""
        raw = np.atleast_1d(self._bits.random_raw(count))
        return [int(bits >> np.uint64(11)) * 2.0**-53 for bits in raw]

    def uniform(self, low: float, high: float) -> float:
        return low + (high - low) * self._units(1)[0]

    def normal(self, spread: float = 1.0) -> float:
        """Gaussian by Box and Muller (1958), cut at two and a half standard deviations."""
        first, second = self._units(2)
        value = math.sqrt(-2.0 * math.log(1.0 - first)) * math.cos(2.0 * math.pi * second)
        return spread * min(max(value, -2.5), 2.5)

    def normals(self, *shape: int) -> np.ndarray:
        """An array of numbers as of ``normal``."""
        raw = self._bits.random_raw(2 * math.prod(shape)).reshape(2, *shape)
        first, second = (raw >> np.uint64(11)) * 2.0**-53
        return np.clip(np.sqrt(-2.0 * np.log(1.0 - first)) * np.cos(2.0 * np.pi * second), -2.5, 2.5)

    def choice(self, options: Sequence[T]) -> T:
        return options[int(self._units(1)[0] * len(options))]

    def sign(self) -> int:
        return self.choice((-1, 1))
