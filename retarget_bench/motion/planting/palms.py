"""Palms, and the bones of its own body that a hand can touch."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.planting.two_bone import Limb, Rig

_PALM = 0.35
"""Fore-arm lengths from the wrist to the palm."""
_BONES = (
    ("head", "head_top"),
    ("hips", "chest"),
    ("chest", "head"),
    ("left_up_leg", "right_up_leg"),
    ("left_arm", "right_arm"),
    ("left_up_leg", "left_leg"),
    ("right_up_leg", "right_leg"),
    ("left_leg", "left_foot"),
    ("right_leg", "right_foot"),
    ("left_arm", "left_forearm"),
    ("left_forearm", "left_hand"),
    ("right_arm", "right_forearm"),
    ("right_forearm", "right_hand"),
)
"""Lines between two joints that a hand can touch (``chest``: the last of the spine)."""


@dataclass(frozen=True)
class Reach:
    """One body's palms and what they can touch, over time.

    palms: ``(frames, 2, 3)`` metres, left and right. starts, ends: ``(frames, bones, 3)``.
    """

    palms: np.ndarray
    starts: np.ndarray
    ends: np.ndarray

    @classmethod
    def of(
        cls, rig: Rig, arms: Sequence[Limb], bones: np.ndarray, places: np.ndarray, turned: np.ndarray
    ) -> Self:
        """arms: the left and the right one. bones: ``(bones, 2)`` joints. places, turned: of all joints, in
        the world."""
        palms = []
        for arm in arms:
            forearm = rig.rest[arm.end] - rig.rest[arm.lower]
            turn = rotation.multiply(
                turned[:, arm.end], rotation.conjugate(rig.character.reference_globals[arm.end])
            )
            palms.append(places[:, arm.end] + _PALM * rotation.rotate(turn, forearm))
        return cls(np.stack(palms, axis=1), places[:, bones[:, 0]], places[:, bones[:, 1]])

    def to_bones(self, hand: int) -> tuple[np.ndarray, np.ndarray]:
        """Where on each bone the place nearest to a palm is: ``(frames, bones, 1)`` its share of the bone,
        and ``(frames, bones, 3)`` metres from there to the palm."""
        line = self.ends - self.starts
        palm = self.palms[:, hand, None]
        square = np.maximum((line * line).sum(-1), 1e-12)
        along = np.clip(((palm - self.starts) * line).sum(-1) / square, 0.0, 1.0)[..., None]
        return along, palm - (self.starts + along * line)


def shared_bones(*rigs: Rig) -> tuple[list[np.ndarray], np.ndarray]:
    """Joint pairs ``(bones, 2)`` of the bones that all these bodies have, on each of them, and which of the
    bones each hand can touch, ``(2, bones)`` 1 or 0."""
    pairs: list[list[list[int]]] = [[] for _ in rigs]
    free: list[list[bool]] = []
    for bone in _BONES:
        ends = [[rig.joint(role) for role in bone] for rig in rigs]
        if bone == ("head", "head_top") and min(map(min, ends)) < 0:
            ends = [[end[0], end[0]] for end in ends]
        if min(map(min, ends)) >= 0:
            for of_one, end in zip(pairs, ends, strict=True):
                of_one.append(end)
            arm = bone[1].endswith(("forearm", "hand"))
            free.append([not (arm and bone[1].startswith(side)) for side in ("left", "right")])
    return [np.array(of_one) for of_one in pairs], np.array(free, dtype=float).T
