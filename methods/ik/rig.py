"""What inverse kinematics needs to know of a body: its limbs, and its joints in the reference pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.roles import chain, is_quadruped
from retarget_bench.motion.transfer import HINGES

from .two_bone import Limb

SIDES = ("left", "right")
_LEG = ("up_leg", "leg", "foot", "toe")
_ARM = ("arm", "forearm", "hand", "")
_BENT = 0.2
"""Sine of the bend from which a four-legged body's own rest pose tells the hinge of a limb."""


@dataclass(frozen=True, eq=False)
class Rig:
    """A character with its reference pose laid out: soles on y = 0, hips above the origin.

    rest: ``(joints, 3)`` metres.
    """

    character: Character
    rest: np.ndarray

    @classmethod
    def of(cls, character: Character) -> Rig:
        places, _ = kinematics.forward(character.skeleton, character.reference_pose, np.zeros(3))
        hips = places[character.joint_of["hips"]]
        return cls(character, places - hips + [0.0, character.measures.hip_height, 0.0])

    @property
    def four_legged(self) -> bool:
        return is_quadruped(self.character.skeleton, self.character.roles)

    def facing(self, motion: Motion) -> np.ndarray:
        """``(frames, 4)`` how the hips are turned from the reference pose in a motion of this body."""
        hips = self.character.joint_of["hips"]
        return rotation.multiply(
            motion.global_rotations[:, hips], rotation.conjugate(self.character.reference_globals[hips])
        )

    def joint(self, role: str) -> int:
        """The joint with this role, or -1; ``chest`` is the last of the spine."""
        if role == "chest":
            return (chain(self.character.roles, "spine") or [-1])[-1]
        return self.character.joint_of.get(role, -1)

    def limb(self, side: str, kind: str) -> Limb | None:
        """The ``leg`` or ``arm`` of a side with its bend axis, or None where it has no two bones."""
        parts = _LEG if kind == "leg" else _ARM
        upper, lower, end, tip = (self.joint(f"{side}_{part}") for part in parts)
        if min(upper, lower, end) < 0:
            return None
        axis = HINGES[f"{side}_{parts[0]}"]
        across = np.cross(self.rest[lower] - self.rest[upper], self.rest[end] - self.rest[lower])
        lengths = self.character.skeleton.bone_lengths[[lower, end]]
        if self.four_legged and np.linalg.norm(across) > _BENT * lengths.prod():
            axis = across / np.linalg.norm(across)
        return Limb(upper, lower, end, tip, axis)
