"""The limbs of a body for inverse kinematics, and its joints in the reference pose."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.hinges import HINGES
from retarget_bench.motion.roles import chain

from .two_bone import Limb

SIDES = ("left", "right")
_PARTS = {"leg": ("up_leg", "leg", "foot", "toe"), "arm": ("arm", "forearm", "hand", "")}
_THICKEST = 0.05
"""Body heights: a rest pose higher above y = 0 than any sole is thick does not stand on it."""
_BENT = 0.2
"""Sine of the bend from which a four-legged body's own rest pose tells the hinge of a limb."""


@dataclass(frozen=True, eq=False)
class Rig:
    """A character with its reference pose laid out: soles on y = 0, hips above the origin.

    rest: ``(joints, 3)`` metres. limbs: by side and ``leg`` or ``arm``, where it has two bones.
    chest: the last joint of the spine, or -1.
    """

    character: Character
    rest: np.ndarray
    limbs: Mapping[tuple[str, str], Limb]
    chest: int
    four_legged: bool

    def joint(self, role: str) -> int:
        """The joint with this role (or ``chest``), or -1."""
        return self.chest if role == "chest" else self.character.joint_of.get(role, -1)

    def facing(self, motion: Motion) -> np.ndarray:
        """``(frames, 4)`` how the hips are turned from the reference pose in a motion of this body."""
        hips = self.character.joint_of["hips"]
        return rotation.multiply(
            motion.global_rotations[:, hips], rotation.conjugate(self.character.reference_globals[hips])
        )


@lru_cache(maxsize=256)
def rig_of(character: Character) -> Rig:
    """The rig of a character, made once."""
    places, _ = kinematics.forward(character.skeleton, character.reference_pose, np.zeros(3))
    hips = places[character.joint_of["hips"]]
    rest = places - hips + [0.0, character.measures.hip_height + _sole(character), 0.0]
    four_legged = character.four_legged
    limbs = {}
    for side in SIDES:
        for kind, parts in _PARTS.items():
            upper, lower, end, tip = (character.joint_of.get(f"{side}_{part}", -1) for part in parts)
            if min(upper, lower, end) >= 0:
                axis = _axis(rest[[upper, lower, end]], four_legged, f"{side}_{parts[0]}")
                limbs[side, kind] = Limb(upper, lower, end, tip, axis)
    chest = (chain(character.roles, "spine") or [-1])[-1]
    return Rig(character, rest, limbs, chest, four_legged)


def _sole(character: Character) -> float:
    """Metres from the floor to the lowest joint of the feet, where the file's rest pose stands on y = 0."""
    sole = character.measures.root_offset - character.measures.hip_height
    stands = character.joint_of["hips"] == 0 and 0.0 < sole < _THICKEST * character.height
    return sole if stands else 0.0


def _axis(places: np.ndarray, bent: bool, first: str) -> np.ndarray:
    """``(3,)`` the axis in the reference pose that a positive turn folds a limb about.

    bent: believe the bend that the reference pose shows, where it shows one.
    """
    upper, lower = places[1] - places[0], places[2] - places[1]
    across = np.cross(upper, lower)
    if bent and np.linalg.norm(across) > _BENT * np.linalg.norm(upper) * np.linalg.norm(lower):
        return np.asarray(across / np.linalg.norm(across))
    return HINGES[first]
