"""Twist bones: each takes its share of how a bone of a limb is twisted, as rigs drive them themselves.

The twist of a forearm is that of the hand against it, and grows from the elbow to the wrist. The twist of
an upper arm is that of the arm against the shoulder, and grows from the shoulder to the elbow; the bone has
all of it, so what lies near the shoulder is turned back. Legs likewise. Shares follow from where the bones
lie.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.editing.orientations import orientation, with_orientations
from retarget_bench.motion.role_aliases import read
from retarget_bench.motion.roles import SIDES, ancestors

WORDS = ("twist", "roll")
"""Names of joints of no role that hold one of these words are twist bones."""
BONES = {
    "arm": ("forearm", False),
    "forearm": ("hand", True),
    "up_leg": ("leg", False),
    "leg": ("foot", True),
}
"""Role at which a bone begins -> the role at its end, and whether the twist is that of the end."""
_AT_START = 0.05
"""Of a bone's length: nearer to its start a twist bone stands for the stretch up to the next."""
_IN_LINE = np.cos(np.radians(3.0))
"""A twist bone between two others of a limb is turned where they are in line, so that nothing moves."""


@dataclass(frozen=True)
class Twist:
    """A twist bone.

    joint:  it. bone: the joints where the limb's bone begins and ends.
    above:  the joint that the bone's twist is against; at the ends of limbs that is ``bone[0]``.
    share:  of the twist that the place has, from 0 to 1. axis: ``(3,)`` unit along the bone, at reference.
    end:    the twist is that of the bone's end against the bone.
    """

    joint: int
    bone: tuple[int, int]
    above: int
    share: float
    axis: np.ndarray
    end: bool


def find(body: Character) -> tuple[Twist, ...]:
    """The twist bones of arms and legs."""
    twists: list[Twist] = []
    for side in SIDES:
        for part, (after, end) in BONES.items():
            bone = body.joints([f"{side}_{part}", f"{side}_{after}"])
            above = _above(body, bone[0]) if bone else None
            if len(bone) < 2 or above is None:
                continue
            line = body.reference_places[bone[1]] - body.reference_places[bone[0]]
            length = float(np.linalg.norm(line))
            joints = (
                [] if length < 1e-9 else [j for j in range(len(body.skeleton)) if _twists(body, j, *bone)]
            )
            along = (
                (body.reference_places[joints] - body.reference_places[bone[0]])
                @ line
                / max(length, 1e-9) ** 2
            )
            order = np.argsort(along, kind="stable")
            for rank, share in zip(order.tolist(), shares(along[order].tolist(), end), strict=True):
                twists.append(Twist(joints[rank], (bone[0], bone[1]), above, share, line / length, end))
    return tuple(sorted(twists, key=lambda each: each.joint))


def shares(along: list[float], end: bool) -> list[float]:
    """The share of a bone's twist for each of its twist bones, which lie at ``along`` (0 to 1, rising).

    A lone one at the start takes half. One at the start of an upper arm or leg has the twist that the skin
    has where the next begins, as on the rigs of iClone; all others take that of their place.
    """
    if len(along) == 1 and not _AT_START < along[0] < 1.0 - _AT_START:
        return [0.5]
    if along and not end and along[0] < _AT_START:
        along = [*along[1:], 1.0]
    return [min(max(each, 0.0), 1.0) for each in along]


def shared(answer: Motion, free: np.ndarray) -> Motion:
    """The answer with its twist bones turned by their shares.

    free: ``(joints,)`` bool, of which joints the source tells nothing; others stay as they are.
    """
    body = answer.character
    orientations: dict[int, np.ndarray] = {}
    for each in find(body):
        if not free[each.joint]:
            continue
        first, last = (orientation(answer, joint) for joint in each.bone)
        if each.end:
            angle = each.share * twist(first, last, each.axis)
        else:
            angle = (each.share - 1.0) * twist(orientation(answer, each.above), first, each.axis)
        turn = rotation.about(np.broadcast_to(each.axis, (len(angle), 3)), angle)
        orientations[each.joint] = rotation.multiply(first, turn)
        if each.joint in ancestors(body.skeleton, each.bone[1]):
            orientations[each.bone[1]] = last
    return with_orientations(answer, orientations)


def twist(above: np.ndarray, below: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """``(frames,)`` radians by which ``below`` is turned about ``axis`` ``(3,)`` against ``above``.

    above, below: ``(frames, 4)`` orientations relative to the reference pose. The turn of one against the
    other is a swing after a twist about the axis; the angle does not jump by whole turns along time.
    """
    turn = rotation.multiply(rotation.conjugate(above), below)
    half = np.arctan2(turn[:, 1:] @ axis, turn[:, 0])
    angle = 2.0 * np.unwrap(half, period=np.pi)
    return angle - 2.0 * np.pi * np.round(angle[:1] / (2.0 * np.pi))


def _above(body: Character, joint: int) -> int | None:
    """The nearest joint above with a role."""
    return next((each for each in ancestors(body.skeleton, joint) if body.roles[each] is not None), None)


def _twists(body: Character, joint: int, first: int, last: int) -> bool:
    """Whether a joint is a twist bone of the bone from one joint to another."""
    words = read(body.skeleton.names)[joint].words
    if body.roles[joint] is not None or not any(word in each for each in words for word in WORDS):
        return False
    if _above(body, joint) != first:
        return False
    if joint not in ancestors(body.skeleton, last):
        return True
    way = [body.reference_places[each] for each in (first, joint, last)]
    before, behind = (b - a for a, b in pairwise(way))
    lengths = float(np.linalg.norm(before) * np.linalg.norm(behind))
    return bool(before @ behind >= _IN_LINE * lengths)
