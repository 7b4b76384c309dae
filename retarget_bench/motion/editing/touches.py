"""Hands of a source that touch their own body.

Motion files state no touches. A hand counts that is near a part of its body and hardly moves against it, as
on a hip, in a pocket or in the other hand; one that swings past is free. The source's own skin tells what
is near, where it has one; else the girths of a slender person are assumed.
"""

from itertools import pairwise

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.editing.girths import PosedParts, arm_points
from retarget_bench.motion.roles import SIDES, chain

PALM = 0.35
"""Forearm lengths from the wrist to the palm."""
_LEG, _ARM, _TRUNK, _WIDER = 0.04, 0.04, 0.075, 1.2
"""Body heights from a bone to the palm of a hand that rests on a slender person, where no skin
shows how thick it is; how many times wider the trunk is to its sides."""
_NEAR = 0.005
"""Body heights from the skin at which a hand is near, or in it."""
_SLOW = 0.15
"""Body heights a second against the body, below which a hand rests."""


def touching(source: Prediction, side: str, own: PosedParts | None = None) -> np.ndarray:
    """``(frames,)`` bool: whether a hand of a source touches its own body.

    source: at a rate at which steps between frames tell speeds, about 15 a second. own: its trunk and
    legs, where its skin is known.
    """
    joint, height = source.character.joint_of, source.character.height
    if not {f"{side}_hand", f"{side}_forearm"} <= joint.keys():
        return np.zeros(source.frames, dtype=bool)
    hand, elbow = (source.positions[:, joint[f"{side}_{part}"]] for part in ("hand", "forearm"))
    palm = hand + PALM * (hand - elbow)
    trunk, limbs, arms = _bones(source.character, side)
    shape = _across(source)
    resting, near, held = np.zeros((3, source.frames), dtype=bool)
    for bones, thick in ((trunk, _TRUNK), (limbs, _LEG), (arms, _ARM)):
        for start, end in bones:
            away, slow = _beside(source, palm, start, end, _SLOW * height)
            if bones is trunk:
                away -= (1.0 - 1.0 / _WIDER) * (away * shape).sum(axis=1, keepdims=True) * shape
            close = np.linalg.norm(away, axis=1) < thick * height
            if bones is arms:
                held |= close & slow
            else:
                near, resting = near | close, resting | slow
    if isinstance(source, Motion) and own is not None and own.parts:
        skin = arm_points(source, side, from_wrist=True)
        if skin.shape[1]:
            near = own.deepest(skin, _NEAR * height)[0] > 0.0
    return np.asarray(held | (near & resting))


def _bones(body: Character, side: str) -> list[list[tuple[int, int]]]:
    """The bones of trunk, legs, and other arm that a body has, each from joint to joint; the other palm is
    at the end of its arm."""
    spine, other = chain(body.roles, "spine")[-1:], SIDES[1 - SIDES.index(side)]
    lines = [
        [body.joints(["hips"]) + spine],
        [body.joints([f"{each}_{part}" for part in ("up_leg", "leg", "foot")]) for each in SIDES],
        [body.joints([f"{other}_{part}" for part in ("arm", "forearm", "hand")])],
    ]
    return [[bone for line in group for bone in pairwise(line)] for group in lines]


def _beside(
    source: Prediction, palm: np.ndarray, start: int, end: int, limit: float
) -> tuple[np.ndarray, np.ndarray]:
    """``(frames, 3)`` metres from the nearest point of a bone to the palm ``(frames, 3)``, and
    ``(frames,)`` whether the palm moves more slowly than a limit, metres a second, against that point.

    A bone that ends in a hand goes on to its palm.
    """
    first, last = source.positions[:, start], source.positions[:, end]
    if (source.character.roles[end] or "").endswith("hand"):
        last = last + PALM * (last - first)
    line, offset = last - first, palm - first
    square = np.maximum((line * line).sum(axis=1), 1e-12)
    along = ((offset * line).sum(axis=1) / square).clip(0.0, 1.0)[:, None]
    if source.frames < 2:
        return offset - along * line, np.ones(source.frames, dtype=bool)
    speeds = [np.gradient(each, 1.0 / source.fps, axis=0) for each in (palm, first, last)]
    against = speeds[0] - (1.0 - along) * speeds[1] - along * speeds[2]
    return offset - along * line, np.linalg.norm(against, axis=1) < limit


def _across(source: Prediction) -> np.ndarray:
    """``(frames, 3)`` unit: from the right hip to the left one; 0 without hips."""
    hips = source.character.joints([f"{side}_up_leg" for side in SIDES])
    if len(hips) < 2:
        return np.zeros((source.frames, 3))
    return np.asarray(rotation.unit(source.positions[:, hips[0]] - source.positions[:, hips[1]]))
