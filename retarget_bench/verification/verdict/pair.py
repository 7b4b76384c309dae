"""A result beside its source: the joints that both have, and what one size is of the other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from retarget_bench.motion.character import Character, Prediction
from retarget_bench.motion.roles import SIDES, bones

NEAR = 0.1
"""Seconds: how far before or after a frame the source may do what the result does in it."""
_BRIEF = 1 / 30
"""Seconds in which changes are measured, so that limits mean the same at any rate."""


_JOINTS = {
    "shoulder": "collar bone",
    "arm": "shoulder",
    "forearm": "elbow",
    "up_leg": "hip",
    "leg": "knee",
    "foot": "ankle",
}


@dataclass(frozen=True, eq=False)
class Pair:
    """Two motions with as many frames at one rate. Only positions are used."""

    source: Prediction
    result: Prediction

    @property
    def fps(self) -> float:
        return float(self.result.fps)

    @property
    def bodies(self) -> tuple[Character, Character]:
        return self.source.character, self.result.character

    @cached_property
    def step(self) -> int:
        """Frames in ``_BRIEF``, one at least."""
        return max(1, round(_BRIEF * self.fps))

    @cached_property
    def near(self) -> int:
        """Frames in ``NEAR``, and at least the two around."""
        return max(2, round(NEAR * self.fps))

    @cached_property
    def brief(self) -> str:
        """The time of a ``step``, for people."""
        return "a frame" if self.step == 1 else f"{self.step} frames"

    @cached_property
    def ratio(self) -> float:
        """Size of the result's body over the source's, by the legs, else by height."""
        theirs, ours = (body.measures for body in self.bodies)
        if theirs.leg_length > 0 and ours.leg_length > 0:
            return ours.leg_length / theirs.leg_length
        return ours.height / theirs.height

    def reach_ratio(self, role: str) -> float:
        """Likewise by the bones from the hips to the joint of a role, but not less than by the legs: hands
        of long arms move faster."""
        theirs, ours = (bones(b.skeleton, b.joint_of[role], b.joint_of.get("hips", 0)) for b in self.bodies)
        return max(self.ratio, ours / theirs) if theirs > 0 else self.ratio

    def has(self, *roles: str) -> bool:
        """True where both bodies have joints of all these roles."""
        return all(role in body.joint_of for body in self.bodies for role in roles)

    def paths(self, role: str) -> tuple[np.ndarray, np.ndarray]:
        """``(frames, 3)`` metres each: the joint of a role in source and result."""
        theirs, ours = (body.joint_of[role] for body in self.bodies)
        return self.source.positions[:, theirs], self.result.positions[:, ours]


def joint_name(role: str) -> str:
    """The joint of a role in the words of people: ``left knee`` for ``left_leg``, where its bone begins."""
    side, _, part = role.partition("_")
    if side not in SIDES:
        return role.replace("_", " ")
    return f"{side} {_JOINTS.get(part, part.replace('_', ' '))}"
