"""Poses in the making, filled in from the root outward."""

from collections.abc import Iterable

import numpy as np

from ..bodies.structures import Body
from ..conventions import SIDES
from ..matrices import from_vector, rotated


class Pose:
    """Orientations ``(parts, frames, 3, 3)`` and positions ``(parts, frames, 3)`` of a body's joints.

    missing: ``(frames,)`` metres by which a hand that reaches down falls short, below 0 where it has room
    to spare, and minus infinity where none reaches down; short: how far short each hand is of any goal.
    """

    def __init__(self, body: Body, frames: int) -> None:
        self.body, parts = body, len(body.structure.parts)
        self.orientations, self.positions = np.zeros((parts, frames, 3, 3)), np.zeros((parts, frames, 3))
        self.missing = np.full(frames, -np.inf)
        self.short: dict[str, np.ndarray] = {}

    def set(self, part: str, orientation: np.ndarray) -> None:
        """Orient a joint; its children's positions follow, and silent children are oriented alike."""
        joint = self.body.part[part]
        self.orientations[joint] = orientation
        for child, name, silent in self.body.children[part]:
            offset = rotated(orientation, self.body.offsets[child])
            np.add(self.positions[joint], offset, out=self.positions[child])
            if silent:
                self.set(name, orientation)

    def set_both(self, part: str, orientations: Iterable[np.ndarray]) -> None:
        """Orient the joints of both sides, ``(2, frames, 3, 3)``."""
        for side, orientation in zip(SIDES, orientations, strict=True):
            self.set(f"{side}_{part}", orientation)

    def bend_spine(self, base: np.ndarray, bend: np.ndarray, lower: float) -> None:
        """Orient the spine above ``base`` ``(frames, 3, 3)``, bent by rotation vectors ``bend`` ``(frames,
        3)`` in all. lower: share of the bend moved from the upmost to the lowest of its joints."""
        bending = self.body.structure.bending
        shares = np.array([*bending.values()])
        shares[0] += lower
        shares[-1] -= lower
        for part, turn in zip(bending, from_vector(shares[:, None, None] * bend), strict=True):
            base = base @ turn
            self.set(part, base)

    def at(self, part: str) -> np.ndarray:
        """``(frames, 3)`` position of a joint."""
        return np.asarray(self.positions[self.body.part[part]])

    def of(self, part: str) -> np.ndarray:
        """``(frames, 3, 3)`` orientation of a joint."""
        return np.asarray(self.orientations[self.body.part[part]])

    def both(self, part: str) -> np.ndarray:
        """``(2, frames, 3)`` positions of a joint of both sides."""
        return np.stack([self.at(f"{side}_{part}") for side in SIDES])
