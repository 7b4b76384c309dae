"""The joints of the SMPL family in the order in which files state them, and an average skeleton with them.

Proportions are those of published tables and none of SMPL's own: lengths and heights of the body as shares
of stature by Drillis and Contini (1966, as printed in Winter, Biomechanics and Motor Control of Human
Movement, 4th ed., fig. 4.1), bones of the hand by Buryanov and Kotiuk (2010, Proportions of hand segments),
both rounded. Where tables say nothing (joints along the spine, collar bones, face) places are ours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from retarget_bench.motion.skeleton import Skeleton, frozen

_TRUNK = (
    ("pelvis", ""),
    ("left_hip", "pelvis"),
    ("right_hip", "pelvis"),
    ("spine1", "pelvis"),
    ("left_knee", "left_hip"),
    ("right_knee", "right_hip"),
    ("spine2", "spine1"),
    ("left_ankle", "left_knee"),
    ("right_ankle", "right_knee"),
    ("spine3", "spine2"),
    ("left_foot", "left_ankle"),
    ("right_foot", "right_ankle"),
    ("neck", "spine3"),
    ("left_collar", "spine3"),
    ("right_collar", "spine3"),
    ("head", "neck"),
    ("left_shoulder", "left_collar"),
    ("right_shoulder", "right_collar"),
    ("left_elbow", "left_shoulder"),
    ("right_elbow", "right_shoulder"),
    ("left_wrist", "left_elbow"),
    ("right_wrist", "right_elbow"),
)
_FINGERS = ("index", "middle", "pinky", "ring", "thumb")
_HANDS = tuple(
    (f"{side}_{finger}{number}", f"{side}_{finger}{number - 1}" if number > 1 else f"{side}_wrist")
    for side in ("left", "right")
    for finger in _FINGERS
    for number in (1, 2, 3)
)
_STUMPS = (("left_hand", "left_wrist"), ("right_hand", "right_wrist"))
_FACE = (("jaw", "head"), ("left_eye_smplhf", "head"), ("right_eye_smplhf", "head"))


@dataclass(frozen=True)
class Family:
    """A skeleton. name: for people. word: in names of files and in ``surface_model_type``."""

    name: str
    word: str
    joints: tuple[str, ...]
    parents: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.joints)


ABOVE = {joint: above for part in (_TRUNK, _STUMPS, _FACE, _HANDS) for joint, above in part}
"""Joint of any of them -> the one above it, "" above the pelvis."""


def _family(name: str, word: str, *parts: tuple[tuple[str, str], ...]) -> Family:
    return of_joints(name, [joint for part in parts for joint, _ in part], word)


def of_joints(name: str, joints: Sequence[str], word: str = "") -> Family:
    """A skeleton of some of these joints, each below the next one above it that is among them."""
    return Family(name, word, tuple(joints), tuple(_above(each, joints) for each in joints))


def _above(joint: str, joints: Sequence[str]) -> int:
    while joint := ABOVE[joint]:
        if joint in joints:
            return joints.index(joint)
    return -1


BODY = _family("SMPL body", "", _TRUNK)
"""The 22 joints that all of them share, without hands."""
SMPL = _family("SMPL", "smpl", _TRUNK, _STUMPS)
SMPLH = _family("SMPL-H", "smplh", _TRUNK, _HANDS)
SMPLX = _family("SMPL-X", "smplx", _TRUNK, _FACE, _HANDS)
H36M = of_joints(
    "Human3.6M",
    (
        *("pelvis", "right_hip", "right_knee", "right_ankle", "left_hip", "left_knee", "left_ankle"),
        *("spine1", "spine3", "neck", "head", "left_shoulder", "left_elbow", "left_wrist"),
        *("right_shoulder", "right_elbow", "right_wrist"),
    ),
)
"""The 17 joints of Human3.6M, as papers on pose estimation state them, in SMPL's names."""
FAMILIES = (BODY, SMPL, SMPLH, SMPLX)
BY_JOINTS = {len(family): family for family in FAMILIES}

# -------------------------------------------------------------------------------------------- proportions
STATURE = 1.69
"""Metres."""
_MIDDLE = {
    "pelvis": (0.0, 0.555, 0.0),
    "spine1": (0.0, 0.615, -0.010),
    "spine2": (0.0, 0.690, -0.010),
    "spine3": (0.0, 0.730, -0.005),
    "neck": (0.0, 0.850, -0.015),
    "head": (0.0, 0.905, 0.010),
    "jaw": (0.0, 0.900, 0.015),
}
"""Shares of stature from between the feet: left, up, forward."""
_LEFT = {
    "hip": (0.050, 0.530, 0.0),
    "knee": (0.050, 0.285, 0.0),
    "ankle": (0.050, 0.039, -0.010),
    "foot": (0.055, 0.012, 0.065),
    "collar": (0.030, 0.818, -0.005),
    "shoulder": (0.110, 0.818, -0.010),
    "elbow": (0.296, 0.818, -0.010),
    "wrist": (0.442, 0.818, -0.010),
    "hand": (0.490, 0.818, -0.010),
    "eye_smplhf": (0.019, 0.935, 0.050),
}
_BONES = {
    "thumb": (46, 32),
    "index": (68, 40, 22),
    "middle": (65, 45, 26),
    "ring": (58, 41, 26),
    "pinky": (54, 33, 18),
}
"""Millimetres: metacarpal, then phalanges as far as the last joint; of the thumb from its base on."""
_SPREAD = {"thumb": 55.0, "index": 18.0, "middle": 4.0, "ring": -10.0, "pinky": -24.0}
"""Degrees forward in which the metacarpals leave a hand whose palm looks down."""
_FINGER = 0.4
"""Share of that angle in which the finger then points."""
_THUMB = (0.012, -0.008, 0.016)
"""Metres from the wrist to the base of the thumb."""


@cache
def offsets(family: Family) -> np.ndarray:
    """``(joints, 3)`` metres from the parent in T-pose, Y up, facing +Z; the root's are 0."""
    places = np.array([_place(joint) for joint in family.joints])
    steps = places - places[list(family.parents)]
    steps[0] = 0.0
    return frozen(steps, np.float64)


def average(family: Family) -> Skeleton:
    """The average skeleton of a family, its pelvis at the origin."""
    return Skeleton(family.joints, np.array(family.parents), offsets(family))


def _place(joint: str) -> np.ndarray:
    if joint in _MIDDLE:
        return STATURE * np.array(_MIDDLE[joint])
    side, _, part = joint.partition("_")
    mirror = np.array([1.0 if side == "left" else -1.0, 1.0, 1.0])
    if part in _LEFT:
        return mirror * STATURE * np.array(_LEFT[part])
    return mirror * (STATURE * np.array(_LEFT["wrist"]) + _along_finger(part[:-1], int(part[-1])))


def _along_finger(finger: str, number: int) -> np.ndarray:
    """``(3,)`` metres from the left wrist to a joint of a finger, counted from 1 at the knuckle."""
    spread = np.radians(_SPREAD[finger])
    bones = np.array(_BONES[finger]) / 1000
    metacarpal = np.array([np.cos(spread), 0.0, np.sin(spread)])
    pointing = np.array([np.cos(_FINGER * spread), 0.0, np.sin(_FINGER * spread)])
    if finger == "thumb":
        return np.array(_THUMB) + bones[: number - 1].sum() * metacarpal
    return bones[0] * metacarpal + bones[1:number].sum() * pointing


def _as_seen(places: np.ndarray, resting: np.ndarray) -> np.ndarray:
    """``(children, 3)`` unit vectors: how children ``(frames, children, 3)`` seen from their joint lie to
    each other, on average, in the pose in which they are ``resting`` ``(children, 3)``."""
    now = places / np.maximum(np.linalg.norm(places, axis=2, keepdims=True), 1e-12)
    then = resting / np.maximum(np.linalg.norm(resting, axis=1, keepdims=True), 1e-12)
    for _ in range(3):  # the mean of turned bones changes how they are turned
        left, _, right = np.linalg.svd(np.einsum("fbi,bj->fij", now, then))
        left[..., -1] *= np.linalg.det(left @ right)[:, None]
        then = np.einsum("fij,fbi->bj", left @ right, now)
        then /= np.maximum(np.linalg.norm(then, axis=1, keepdims=True), 1e-12)
    return then


def fitted_to(family: Family, positions: np.ndarray) -> Skeleton:
    """The skeleton in T-pose with the bones that positions ``(frames, joints, 3)`` show, in their unit.

    A bone is as long as in the middle of the clip. Several bones that leave one joint lie to each other as
    they do there on average; others point as in the average skeleton.
    """
    resting, bones = offsets(family), np.zeros((len(family), 3))
    steps = positions - positions[:, list(family.parents)]
    lengths = np.median(np.linalg.norm(steps, axis=2), axis=0)
    for joint in range(len(family)):
        children = [child for child, parent in enumerate(family.parents) if parent == joint]
        if not children:
            continue
        directions = resting[children]
        if len(children) > 2:
            directions = _as_seen(steps[:, children], directions)
        sizes = np.maximum(np.linalg.norm(directions, axis=1), 1e-12)
        bones[children] = directions * (lengths[children] / sizes)[:, None]
    return Skeleton(family.joints, np.array(family.parents), bones)
