"""A pose in the making, and what the passes of the solver agree on."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .bodies import Body
from .limbs import rotated
from .score import SIDES


@dataclass(eq=False)
class Pose:
    """Orientations ``(parts, frames, 3, 3)`` and places ``(parts, frames, 3)``, filled in from the root
    outward.
    missing: ``(frames,)`` metres by which a hand that reaches down falls short, below 0 where it has
    room to spare, and minus infinity where none reaches down; short: how far short each hand is, whatever
    it does."""

    body: Body
    turned: np.ndarray
    places: np.ndarray
    missing: np.ndarray
    short: dict[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def start(cls, body: Body, frames: int) -> Pose:
        parts = len(body.structure.parts)
        turned, places = np.zeros((parts, frames, 3, 3)), np.zeros((parts, frames, 3))
        return cls(body, turned, places, np.full(frames, -np.inf))

    def set(self, part: str, turned: np.ndarray) -> None:
        """Orient a joint; its children's places follow."""
        joint = self.body.part[part]
        self.turned[joint] = turned
        for child, name, silent in self.body.children[part]:
            np.add(self.places[joint], rotated(turned, self.body.offsets[child]), out=self.places[child])
            if silent:
                self.set(name, turned)

    def set_both(self, part: str, turned: np.ndarray) -> None:
        """Orient the joints of both sides, ``(2, frames, 3, 3)``."""
        for side, turn in zip(SIDES, turned, strict=True):
            self.set(f"{side}_{part}", turn)

    def at(self, part: str) -> np.ndarray:
        return np.asarray(self.places[self.body.part[part]])

    def of(self, part: str) -> np.ndarray:
        return np.asarray(self.turned[self.body.part[part]])

    def both(self, part: str) -> np.ndarray:
        """``(2, frames, 3)`` places of a joint of both sides."""
        return np.stack([self.at(f"{side}_{part}") for side in SIDES])


@dataclass(frozen=True, eq=False)
class State:
    """What the passes agree on: the pelvis' shift ``(frames, 2)`` for balance, metres, the trunk's
    additional lean ``(frames,)``, radians, how far the hips sink for a hand that is to reach down
    ``(frames,)``, metres, how far the pelvis is off its height ``(frames,)``, metres, for
    the centre of mass to fall freely, where the centre of mass was before any shift, and how much the hips
    sink ``(frames,)``, metres, for hands that are planted on the floor."""

    shift: np.ndarray
    lean: np.ndarray
    low: np.ndarray
    thrown: np.ndarray
    unbalanced: np.ndarray | None = None
    crouch: np.ndarray | float = 0.0

    @classmethod
    def start(cls, frames: int) -> State:
        return cls(np.zeros((frames, 2)), np.zeros(frames), np.zeros(frames), np.zeros(frames))
