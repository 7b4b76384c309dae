"""Evidence in a body's bones for the rotations of its joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.hinges import FOLDED
from retarget_bench.motion.skeleton import frozen

NOTHING = 1e-5
"""Metres: a bone shorter than this tells no direction; bones this near to one line tell no twist."""
_FOLDED = 0.3
"""Sine of the angle of two bones in the reference pose from where on their plane shows a hinge."""


@dataclass(frozen=True, eq=False)
class Sight:
    """The evidence for one joint's rotation.

    own:      children at the ends of bones that leave this joint and have a length.
    borrowed: the same of zero-length children and theirs, which stand in the same place: likely, but not
              surely, they turn with this joint.
    axis:     ``(3,)`` the direction in which the own bones lie most, in the reference pose; 0 without any.
    spread:   metres that the ends of the own bones lie off that line: how well the twist about it is seen.
    lent:     share of their length that the ends of all bones, borrowed ones too, lie off one line.
    hinge:    ``(3,)`` the axis, in the reference pose, about which ``bend[1]`` swings round ``bend[0]``:
              the two bones after this joint, by their ends. None where no hinge is known.
    """

    own: tuple[int, ...]
    borrowed: tuple[int, ...]
    axis: np.ndarray
    spread: float
    lent: float
    hinge: np.ndarray | None = None
    bend: tuple[int, int] = (-1, -1)


@dataclass(frozen=True, eq=False)
class Tree:
    """A body laid out for fitting.

    bones: ``(joints, 3)`` metres in the reference pose, from parent to joint; 0 for the root.
    sights: one per joint.
    """

    character: Character
    parents: tuple[int, ...]
    children: tuple[tuple[int, ...], ...]
    bones: np.ndarray
    lengths: np.ndarray
    sights: tuple[Sight, ...]

    @classmethod
    def of(cls, character: Character) -> Tree:
        skeleton = character.skeleton
        above = character.reference_globals.take(skeleton.parents, axis=0)
        bones = rotation.rotate(above, skeleton.offsets)
        bones[0] = 0.0
        lengths = np.linalg.norm(bones, axis=1)
        owns = [tuple(c for c in below if lengths[c] > NOTHING) for below in skeleton.children]
        sights = tuple(_sight(character, j, owns, bones, lengths) for j in range(len(skeleton)))
        parents = tuple(skeleton.parents.tolist())
        return cls(character, parents, skeleton.children, frozen(bones, np.float64), lengths, sights)

    def places(self, turned: np.ndarray, root: np.ndarray) -> np.ndarray:
        """``(frames, joints, 3)`` metres, of orientations ``(frames, joints, 4)`` relative to the reference
        pose and a root ``(frames, 3)``."""
        out = np.empty((*turned.shape[:2], 3))
        out[:, 0] = root
        steps = rotation.rotate(turned.take(self.parents, axis=1), self.bones)
        for joint, parent in enumerate(self.parents[1:], 1):
            out[:, joint] = out[:, parent] + steps[:, joint]
        return out


def _sight(
    character: Character, joint: int, owns: list[tuple[int, ...]], bones: np.ndarray, lengths: np.ndarray
) -> Sight:
    own = owns[joint]
    borrowed = _borrowed(character.skeleton.children, owns, joint)
    ends = [*own, *borrowed]
    lent = _off_line(bones[ends] / lengths[ends, None])[1] if borrowed else 0.0
    if not own:
        return Sight(own, borrowed, np.zeros(3), 0.0, lent)
    axis, spread = _off_line(bones[list(own)])
    bend = _bend(character, joint, owns)
    if bend is None:
        return Sight(own, borrowed, axis, spread, lent)
    return Sight(own, borrowed, axis, spread, lent, _hinge(character, joint, *bones[list(bend)]), bend)


def _bend(character: Character, joint: int, owns: list[tuple[int, ...]]) -> tuple[int, int] | None:
    """The joints at the ends of an upper and a lower limb: by role, since sleeves and straps may leave them
    too, else where there is no choice."""
    own, limb = owns[joint], character.joints(FOLDED.get(character.roles[joint] or "", ()))
    if len(limb) == 2 and limb[0] in own and limb[1] in owns[limb[0]]:
        return limb[0], limb[1]
    alone = len(own) == 1 and len(owns[own[0]]) == 1
    return (own[0], owns[own[0]][0]) if alone else None


def _off_line(bones: np.ndarray) -> tuple[np.ndarray, float]:
    """``(3,)`` unit: the line that bones ``(bones, 3)`` lie along most, the way the longest points, and how
    far off it their ends are (the root of the sum of squares)."""
    _, sizes, axes = np.linalg.svd(bones)
    longest = bones[np.square(bones).sum(axis=1).argmax()]
    sign = -1.0 if axes[0] @ longest < 0 else 1.0
    return sign * axes[0], float(np.linalg.norm(sizes[1:]))


def _borrowed(
    children: tuple[tuple[int, ...], ...], owns: list[tuple[int, ...]], joint: int
) -> tuple[int, ...]:
    """The ends of bones that leave zero-length children, and theirs in turn."""
    found: list[int] = []
    for child in children[joint]:
        if child not in owns[joint]:
            found += [*owns[child], *_borrowed(children, owns, child)]
    return tuple(found)


def _hinge(character: Character, joint: int, upper: np.ndarray, lower: np.ndarray) -> np.ndarray | None:
    """``(3,)`` unit: of knees and elbows; of four legs, whose joints are folded at rest, by that."""
    axis = character.hinge(character.roles[joint] or "")
    if axis is None:
        return None
    if character.four_legged:
        axis = np.cross(upper, lower) / (np.linalg.norm(upper) * np.linalg.norm(lower))
    along = upper / np.linalg.norm(upper)
    rest = axis - along * (along @ axis)
    size = float(np.linalg.norm(rest))
    return rest / size if size > _FOLDED else None
