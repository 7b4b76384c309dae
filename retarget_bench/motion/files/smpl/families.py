"""The joints of the SMPL family's skeletons, in the order in which poses and joint arrays state them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
