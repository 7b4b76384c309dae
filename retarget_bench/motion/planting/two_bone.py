"""The limbs of a body, and reaching with one of two bones, in closed form over all frames at once."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.hinges import HINGES
from retarget_bench.motion.planting.ease import limited, smooth
from retarget_bench.motion.roles import SIDES, chain

_PARTS = {"leg": ("up_leg", "leg", "foot", "toe"), "arm": ("arm", "forearm", "hand", "")}
_BENT = 0.2
"""Sine of the bend from which a four-legged body's own rest pose tells the hinge of a limb."""
ARM, LEG = (0.25, 0.4, 0.9, 0.98), (0.0, 0.0, 0.97, 0.99)
"""Shares of its length that a limb is made to span: the least, from where to where it is free, the most."""
_FASTEST, _SLOW = 1.4, np.radians(60.0)
"""How many times its greatest copied speed a joint may turn; radians per second that it may at least."""
_SETTLE, _NEAR = 0.1, 1e-6
"""Seconds over which a joint that would turn faster is smoothed; radians that make a difference."""
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
    rest, limbs = character.standing_places, {}
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

    @classmethod
    def of(cls, motion: Motion) -> Self:
        """The pose of a motion, whose arrays are changed in place."""
        return cls(motion.rotations, motion.root, motion.positions, motion.global_rotations)

    def stand(self, body: Character) -> None:
        """Bring places and orientations up to date with rotations and root of ``body``.

        The old ones are let go first: those of ten minutes are 50 megabytes.
        """
        del self.places, self.turned
        self.places, self.turned = kinematics.forward(body.skeleton, self.rotations, self.root)

    def shift(self, offset: np.ndarray) -> None:
        """Move the whole body by ``offset`` ``(frames, 3)`` metres."""
        self.root = self.root + offset
        self.places = self.places + offset[:, None]


def reach(pose: Pose, limb: Limb) -> float:
    """Metres: the length of the limb when it is straight."""
    upper, lower, end = (pose.places[0, joint] for joint in (limb.upper, limb.lower, limb.end))
    return float(np.linalg.norm(lower - upper) + np.linalg.norm(end - lower))


def ease_reach(
    pose: Pose, limb: Limb, goal: np.ndarray, shares: tuple[float, float, float, float] = ARM
) -> np.ndarray:
    """``goal`` ``(frames, 3)`` drawn in smoothly where it asks for a nearly straight or wholly folded limb.

    There a hair's breadth at the end of the limb swings its middle joint wildly. What the limb spans as it
    was copied stays allowed. shares: ``ARM`` or ``LEG``.
    """
    first = pose.places[:, limb.upper]
    copied, far = _norm(pose.places[:, limb.end] - first), _norm(goal - first)
    low, soft_low, soft_high, high = (share * reach(pose, limb) for share in shares)
    low, soft_low = np.minimum(low, copied), np.minimum(soft_low, copied)
    soft_high, high = np.maximum(soft_high, copied), np.maximum(high, copied)
    folded = soft_low - _saturate(soft_low - far, soft_low - low)
    stretched = soft_high + _saturate(far - soft_high, high - soft_high)
    out = np.where(far < soft_low, folded, np.where(far > soft_high, stretched, far))
    return first + (goal - first) * (out / np.maximum(far, 1e-9))


def _saturate(over: np.ndarray, room: np.ndarray) -> np.ndarray:
    """From 0 with slope 1 up to ``room``, which is reached at infinity."""
    room = np.maximum(room, 1e-9)
    return room * (1.0 - np.exp(-np.maximum(over, 0.0) / room))


def fold(upper: np.ndarray, lower: np.ndarray, goal: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """World turn of the second bone that brings the end of a limb as far from its first joint as the goal.

    upper, lower: ``(frames, 3)`` the two bones as vectors, metres.
    goal:         ``(frames, 3)`` where the end shall be, from the limb's first joint. Beyond reach the
                  limb is straight.
    axis:         ``(frames, 3)`` the anatomical bend axis; a positive turn about it folds the limb.
    Returns ``(frames, 4)``, to be applied on the left of the bone's world orientation. The limb keeps its
    bend plane.
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
    return rotation.about(normal, bend[:, 0])


def bend(body: Character, pose: Pose, limb: Limb, goal: np.ndarray, end: np.ndarray, fps: float) -> None:
    """Bring a limb's end to ``goal`` ``(frames, 3)``, with world orientation ``end`` ``(frames, 4)``.

    In place: only the limb's three local rotations change, not ``pose.places`` and ``pose.turned``. Where a
    joint would become faster than ``_FASTEST`` times its own greatest speed before, the goal is missed.
    """
    joints, parents = (limb.upper, limb.lower, limb.end), body.skeleton.parents
    first, second, last = (pose.places[:, joint] for joint in joints)
    upper, lower, _ = (pose.turned[:, joint] for joint in joints)
    above = [pose.turned[:, parents[joint]] for joint in joints]
    rest = rotation.conjugate(body.reference_globals[limb.upper])
    axis = rotation.rotate(rotation.multiply(upper, rest), limb.axis)

    def turned(joint: int, above: np.ndarray, world: np.ndarray) -> np.ndarray:
        local = rotation.multiply(rotation.conjugate(above), world)
        pose.rotations[:, joint] = slowed(pose.rotations[:, joint], local, fps)
        return rotation.multiply(above, pose.rotations[:, joint])

    folded = fold(second - first, last - second, goal - first, axis)
    folded = turned(limb.lower, above[1], rotation.multiply(folded, lower))
    folded = rotation.multiply(folded, rotation.conjugate(lower))
    swing = rotation.between(second - first + rotation.rotate(folded, last - second), goal - first)
    swing = turned(limb.upper, above[0], rotation.multiply(swing, upper))
    swing = rotation.multiply(swing, rotation.conjugate(upper))
    turned(limb.end, rotation.multiply(swing, rotation.multiply(folded, above[2])), end)


def slowed(copied: np.ndarray, rotations: np.ndarray, fps: float) -> np.ndarray:
    """A joint's local ``rotations`` ``(frames, 4)``, ``_FASTEST`` times as fast as copied at most.

    The change from the copied ones is slowed to what the copied motion leaves of the limit in each frame.
    """
    change = rotation.to_rotation_vector(rotation.multiply(rotations, rotation.conjugate(copied)))
    steps, own = np.abs(np.diff(change, axis=0)), rotation.angle(copied[1:], copied[:-1])
    room = _FASTEST * max(own.max(initial=0.0), _SLOW / fps) - own
    if (np.linalg.norm(steps, axis=1) <= room).all():
        return rotations
    share = steps.max(axis=0)
    slow = limited(change, room[:, None] * share / np.linalg.norm(share))
    near = smooth(1.0 * (np.abs(slow - change) > _NEAR).any(axis=1, keepdims=True), fps, _SETTLE)
    slow += near * (smooth(slow, fps, _SETTLE) - slow)
    return rotation.multiply(rotation.from_rotation_vector(slow), copied)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("fc,fc->f", a, b)[:, None]


def _norm(a: np.ndarray) -> np.ndarray:
    return np.sqrt(_dot(a, a))


def _unit(a: np.ndarray) -> np.ndarray:
    return a / np.maximum(_norm(a), 1e-12)
