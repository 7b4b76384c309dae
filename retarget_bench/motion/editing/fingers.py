"""Fingers that a source lacks: a relaxed hand instead of the flat one of the T-pose.

A finger that the source lacks while it has others (a hand of three fingers) does as the nearest one does.
"""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.body import DOWN
from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.editing.orientations import orientation, with_orientations
from retarget_bench.motion.role_aliases import NUMBERED_FINGERS as FINGERS
from retarget_bench.motion.roles import SIDES

Hands = Literal["relaxed", "open"]

LONG = FINGERS[1:]
RELAXED = {
    "thumb": (8.0, 15.0, 20.0),
    "index": (18.0, 26.0, 14.0),
    "middle": (24.0, 32.0, 18.0),
    "ring": (28.0, 36.0, 20.0),
    "pinky": (30.0, 36.0, 20.0),
}
"""Degrees by which the joints of a hand at rest are bent, from the knuckle on: more towards the little
finger, most in the middle joint."""
_MOVES = np.radians(5.0)
"""A lone finger that turns less against its hand is a stub, which says nothing of fingers."""
_APART = 1e-6

Finger = list[int]
"""Its joints from the knuckle on."""


def fingers(body: Character, side: str) -> dict[str, Finger]:
    """The fingers of one hand, from thumb to little finger."""
    hand: dict[str, Finger] = {}
    for finger in FINGERS:
        stem = f"{side}_{finger}_"
        numbers = sorted(int(role.removeprefix(stem)) for role in body.joint_of if role.startswith(stem))
        if numbers:
            hand[finger] = [body.joint_of[f"{stem}{number}"] for number in numbers]
    return hand


def shown(source: Prediction, side: str) -> frozenset[str]:
    """The fingers of one hand whose motion the source has: all of them, or none.

    One finger beside the thumb tells where it moves; else it is a stub, as in files of CMU.
    """
    joints = fingers(source.character, side)
    long = [finger for finger in joints if finger in LONG]
    if len(long) == 1 and isinstance(source, Motion):
        hand = rotation.conjugate(orientation(source, source.character.joint_of[f"{side}_hand"]))
        bends = [rotation.multiply(hand, orientation(source, joint)) for joint in joints[long[0]]]
        if any(rotation.angle(bend, bend[:1]).max(initial=0.0) > _MOVES for bend in bends):
            return frozenset(joints)
    return frozenset(joints) if len(long) > 1 else frozenset()


def followed(answer: Motion, source: Prediction) -> Motion:
    """The answer with fingers that the source lacks as their nearest neighbours are that it has."""
    body = answer.character
    orientations: dict[int, np.ndarray] = {}
    for side in SIDES:
        hand, in_source = fingers(body, side), shown(source, side)
        common = [finger for finger in hand if finger in in_source and finger in LONG]
        for finger in [each for each in hand if common and each in LONG and each not in in_source]:
            near = hand[min(common, key=lambda each: abs(FINGERS.index(each) - FINGERS.index(finger)))]
            for rank, joint in enumerate(hand[finger]):
                orientations[joint] = orientation(answer, near[min(rank, len(near) - 1)])
    return with_orientations(answer, orientations)


def relaxed(answer: Motion, source: Prediction) -> Motion:
    """The answer with relaxed hands on the sides of which the source shows no finger. A hand of a thumb
    alone is a stub and stays."""
    body, rotations = answer.character, np.array(answer.rotations)
    bare = [side for side in SIDES if fingers(body, side).keys() & set(LONG) and not shown(source, side)]
    if body.four_legged or not bare:
        return answer
    for side in bare:
        for joint, local in curl(body, side).items():
            rotations[:, joint] = local
    return body.motion(rotations, answer.root, answer.fps)


# -------------------------------------------------------------------------------------- a hand at rest
def curl(body: Character, side: str) -> dict[int, np.ndarray]:
    """Joint -> ``(4,)`` local rotation of the fingers of a relaxed hand.

    Each joint is bent from the reference pose about the finger's hinge, by what it lacks of ``RELAXED``: a
    hand that rests half closed is closed no further.
    """
    hand = fingers(body, side)
    hinges = _hinges(body, side, hand)
    turned: dict[int, np.ndarray] = {}
    for finger, joints in hand.items():
        axis, bent, total = hinges[finger], 0.0, 0.0
        for rank, joint in enumerate(joints):
            bone = _bone(body, joints, rank)
            if rank < len(RELAXED[finger]) and bone.any():
                total += np.radians(RELAXED[finger][rank])
                line = _palm(body, side, hand) if finger in LONG else _bone(body, joints, 0)
                bent = max(bent, total - _angle(line, bone, axis), 0.0)
            turned[joint] = rotation.about(axis, bent)
    world = {
        joint: rotation.multiply(turn, body.reference_globals[joint]) for joint, turn in turned.items()
    }
    above = {joint: int(body.skeleton.parents[joint]) for joint in turned}
    parents = {joint: world.get(up, body.reference_globals[up]) for joint, up in above.items()}
    return {
        joint: rotation.multiply(rotation.conjugate(parents[joint]), turn) for joint, turn in world.items()
    }


def _hinges(body: Character, side: str, hand: Mapping[str, Finger]) -> dict[str, np.ndarray]:
    """Finger -> ``(3,)`` the axis in the reference pose about which a positive turn closes it.

    Knuckles lie along the hinge. A hand with fewer than two of them has its palm down, as in a T-pose.
    """
    places, long = body.reference_places, [finger for finger in hand if finger in LONG]
    line = _palm(body, side, hand)
    row = places[hand[long[-1]][0]] - places[hand[long[0]][0]] if long else np.zeros(3)
    row = row if side == "left" else -row
    if np.linalg.norm(row) < _APART:
        row = np.cross(line, DOWN)
    row = _across(row, line)
    hinges = {finger: _across(row, _bone(body, hand[finger], 0)) for finger in long}
    if "thumb" in hand:
        thumb = _bone(body, hand["thumb"], 0)
        towards = np.cross(row, line) + (row if side == "left" else -row)
        hinges["thumb"] = _across(np.cross(thumb, towards), thumb)
    return hinges


def _palm(body: Character, side: str, hand: Mapping[str, Finger]) -> np.ndarray:
    """``(3,)`` unit: from the wrist to the knuckles in the reference pose."""
    places = body.reference_places
    knuckles = [joints[0] for finger, joints in hand.items() if finger in LONG]
    if knuckles and f"{side}_hand" in body.joint_of:
        return _unit(places[knuckles].mean(axis=0) - places[body.joint_of[f"{side}_hand"]])
    return np.array([1.0 if side == "left" else -1.0, 0.0, 0.0])


def _bone(body: Character, joints: Sequence[int], rank: int) -> np.ndarray:
    """``(3,)`` unit: from a joint of a finger to the next, or to its tip; 0 where it has none."""
    joint, places = joints[rank], body.reference_places
    if rank + 1 < len(joints):
        return _unit(places[joints[rank + 1]] - places[joint])
    for site in body.skeleton.end_sites:
        if site.parent == joint:
            return _unit(rotation.rotate(body.reference_globals[joint], np.array(site.offset)))
    return _unit(places[joint] - places[joints[rank - 1]]) if rank else np.zeros(3)


def _angle(line: np.ndarray, bone: np.ndarray, axis: np.ndarray) -> float:
    """Radians by which ``bone`` is turned about the axis from ``line``."""
    line, bone = _across(line, axis), _across(bone, axis)
    return float(np.arctan2(np.cross(line, bone) @ axis, line @ bone))


def _across(vector: np.ndarray, line: np.ndarray) -> np.ndarray:
    """``(3,)`` unit: the part of a vector that is across a unit line."""
    return _unit(vector - line * (line @ vector))


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
