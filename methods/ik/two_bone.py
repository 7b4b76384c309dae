"""The limbs of a body, and reaching with one of two bones, in closed form over all frames at once."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.hinges import HINGES
from retarget_bench.motion.roles import SIDES, chain

_PARTS = {"leg": ("up_leg", "leg", "foot", "toe"), "arm": ("arm", "forearm", "hand", "")}
_THICKEST = 0.05
"""Body heights: a rest pose higher above y = 0 than any sole is thick does not stand on it."""
_BENT = 0.2
"""Sine of the bend from which a four-legged body's own rest pose tells the hinge of a limb."""
_SPAN, _EASY = (0.25, 0.98), (0.4, 0.9)
"""Shares of its length that a limb is made to span at least and at most, and between which it is free."""
_LEAN = 0.1
"""How strongly the anatomical hinge axis speaks against the bend at hand: it decides for straight limbs."""


@dataclass(frozen=True)
class Limb:
    """Joint numbers of a limb on one body, and how it folds.

    tip:  the toe, or -1 where there is none.
    axis: ``(3,)`` in the reference pose; a positive turn about it folds the limb.
    """

    upper: int
    lower: int
    end: int
    tip: int
    axis: np.ndarray


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
    places, height = character.reference_places, character.measures.hip_height
    sole = character.measures.root_offset - height  # where the file's rest pose stands on y = 0
    if character.joint_of["hips"] != 0 or not 0.0 < sole < _THICKEST * character.height:
        sole = 0.0
    rest = places - places[character.joint_of["hips"]] + [0.0, height + sole, 0.0]
    limbs = {}
    for side in SIDES:
        for kind, parts in _PARTS.items():
            upper, lower, end, tip = (character.joint_of.get(f"{side}_{part}", -1) for part in parts)
            if min(upper, lower, end) >= 0:
                axis, first, second = (
                    HINGES[f"{side}_{parts[0]}"],
                    rest[lower] - rest[upper],
                    rest[end] - rest[lower],
                )
                across, lengths = np.cross(first, second), np.linalg.norm(first) * np.linalg.norm(second)
                if character.four_legged and np.linalg.norm(across) > _BENT * lengths:
                    axis = across / np.linalg.norm(across)
                limbs[side, kind] = Limb(upper, lower, end, tip, axis)
    return Rig(character, rest, limbs, (chain(character.roles, "spine") or [-1])[-1])


# ------------------------------------------------------------------------------------------ reaching
@dataclass
class Pose:
    """A motion being worked on: local rotations and root, with its places and orientations in the world."""

    rotations: np.ndarray
    root: np.ndarray
    places: np.ndarray
    turned: np.ndarray

    def shift(self, offset: np.ndarray) -> None:
        """Move the whole body by ``offset`` ``(frames, 3)`` metres."""
        self.root = self.root + offset
        self.places = self.places + offset[:, None]


def reach(pose: Pose, limb: Limb) -> float:
    """Metres: the length of the limb when it is straight."""
    upper, lower, end = (pose.places[0, joint] for joint in (limb.upper, limb.lower, limb.end))
    return float(np.linalg.norm(lower - upper) + np.linalg.norm(end - lower))


def ease_reach(pose: Pose, limb: Limb, goal: np.ndarray) -> np.ndarray:
    """``goal`` ``(frames, 3)`` drawn in smoothly where it asks for a nearly straight or wholly folded limb.

    There a hair's breadth at the end of the limb swings its middle joint wildly. What the limb spans as it
    was copied stays allowed.
    """
    first = pose.places[:, limb.upper]
    copied = _norm(pose.places[:, limb.end] - first)
    whole, far = reach(pose, limb), _norm(goal - first)
    low, high = np.minimum(_SPAN[0] * whole, copied), np.maximum(_SPAN[1] * whole, copied)
    soon, late = np.minimum(_EASY[0] * whole, copied), np.maximum(_EASY[1] * whole, copied)
    folded = soon - _saturate(soon - far, soon - low)
    stretched = late + _saturate(far - late, high - late)
    out = np.where(far < soon, folded, np.where(far > late, stretched, far))
    return first + (goal - first) * (out / np.maximum(far, 1e-9))


def _saturate(over: np.ndarray, room: np.ndarray) -> np.ndarray:
    """From 0 with slope 1 up to ``room``, which is reached at infinity."""
    room = np.maximum(room, 1e-9)
    return room * (1.0 - np.exp(-np.maximum(over, 0.0) / room))


def solve(
    upper: np.ndarray, lower: np.ndarray, goal: np.ndarray, axis: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """World turns of the two bones that bring the end of the limb to its goal.

    upper, lower: ``(frames, 3)`` the two bones as vectors, metres.
    goal:         ``(frames, 3)`` where the end shall be, from the limb's first joint. Beyond reach the
                  limb points at it, straight.
    axis:         ``(frames, 3)`` the anatomical bend axis; a positive turn about it folds the limb.
    Returns the turn of the first bone and that of the second, ``(frames, 4)`` each, to be applied on the
    left of their world orientations. The limb keeps its bend plane, turned by the shortest arc.
    """
    across = np.cross(_unit(upper), _unit(lower))
    against = np.maximum(0.0, -_dot(across, axis))
    normal = _unit(across + (_LEAN + 2.0 * against) * axis)
    a, b = _dot(upper, normal), _dot(lower, normal)
    flat_a, flat_b = upper - a * normal, lower - b * normal
    size_a, size_b = _norm(flat_a), _norm(flat_b)
    now = np.arctan2(_dot(np.cross(flat_a, flat_b), normal), _dot(flat_a, flat_b))
    far = _dot(goal, goal) - (a + b) ** 2
    cosine = (far - size_a**2 - size_b**2) / np.maximum(2.0 * size_a * size_b, 1e-12)
    bend = np.arccos(np.clip(cosine, -1.0, 1.0)) - now
    fold = rotation.about(normal, bend[:, 0])
    swing = rotation.between(upper + rotation.rotate(fold, lower), goal)
    return swing, rotation.multiply(swing, fold)


def bend(body: Character, pose: Pose, limb: Limb, goal: np.ndarray, end: np.ndarray) -> None:
    """Bring a limb's end to ``goal`` ``(frames, 3)``, with world orientation ``end`` ``(frames, 4)``.

    In place: only the limb's three local rotations change, not ``pose.places`` and ``pose.turned``.
    """
    first, second, last = pose.places[:, limb.upper], pose.places[:, limb.lower], pose.places[:, limb.end]
    upper, lower = pose.turned[:, limb.upper], pose.turned[:, limb.lower]
    rest = rotation.conjugate(body.reference_globals[limb.upper])
    axis = rotation.rotate(rotation.multiply(upper, rest), limb.axis)
    swing, fold = solve(second - first, last - second, goal - first, axis)
    parents = body.skeleton.parents
    for joint, above, world in (
        (limb.upper, None, rotation.multiply(swing, upper)),
        (limb.lower, swing, rotation.multiply(fold, lower)),
        (limb.end, fold, end),
    ):
        parent = pose.turned[:, parents[joint]]
        if above is not None:
            parent = rotation.multiply(above, parent)
        pose.rotations[:, joint] = rotation.multiply(rotation.conjugate(parent), world)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("fc,fc->f", a, b)[:, None]


def _norm(a: np.ndarray) -> np.ndarray:
    return np.sqrt(_dot(a, a))


def _unit(a: np.ndarray) -> np.ndarray:
    return a / np.maximum(_norm(a), 1e-12)
