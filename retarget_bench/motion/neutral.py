"""Neutral poses: a body that stands with its arms along it, as templates of skeletons show it.

Some methods learn what a skeleton is from such a pose (HuMoT, section 3.2, whose authors set one by hand
for every data set). Roles and the common reference pose give one for any body.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import kinematics
from retarget_bench.motion.body import DOWN, Body
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, Positions
from retarget_bench.motion.roles import SIDES
from retarget_bench.motion.skeleton import Skeleton

NOTHING = 1e-9
"""Metres: a bone this short has no direction."""


def neutral_pose(character: Character) -> np.ndarray:
    """``(joints, 4)`` local rotations: the reference pose with both arms hanging straight down.

    Hands and what has no role keep to their parents. On four legs it is the reference pose.
    """
    pose = np.array(character.reference_pose)
    if character.four_legged:
        return pose
    body = Body(character.skeleton, character.roles)
    for side in SIDES:
        joints = body.joints(*(f"{side}_{part}" for part in ("arm", "forearm", "hand")))
        for joint, child in pairwise(joints):
            body.swing(pose, joint, child, DOWN)
    return pose


def template(motion: Character | Motion | Positions) -> np.ndarray:
    """``(joints, 3)`` metres: the neutral pose with the hips at the origin, Y up, facing +Z, left is +X.

    Bones are as long as the character's; for positions, as long as they are there (the temporal median).
    Raises SkeletonError where no joint is known as hips.
    """
    character = motion if isinstance(motion, Character) else motion.character
    hips = character.joint_of.get("hips", -1)
    if hips < 0:
        raise SkeletonError(f"no joint of {character.name} is known as hips; name it in a roles file")
    places = kinematics.forward(character.skeleton, neutral_pose(character), np.zeros(3))[0]
    if isinstance(motion, Positions):
        places = _stretched(character.skeleton, places, median_lengths(motion))
    return np.asarray(places - places[hips])


def median_lengths(motion: Positions) -> np.ndarray:
    """``(joints,)`` metres from each joint to its parent, the median over time; 0 for the root."""
    parents = motion.skeleton.parents
    lengths = np.zeros(len(parents))
    below = np.flatnonzero(parents >= 0)
    bones = motion.positions[:, below] - motion.positions[:, parents[below]]
    lengths[below] = np.median(np.linalg.norm(bones, axis=-1), axis=0)
    return lengths


def _stretched(skeleton: Skeleton, places: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """A pose ``(joints, 3)`` with bones of these lengths in the directions they have."""
    found = np.zeros_like(places)
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if parent < 0:
            continue
        bone = places[joint] - places[parent]
        size = float(np.linalg.norm(bone))
        found[joint] = found[parent] + (bone * (lengths[joint] / size) if size > NOTHING else bone)
    return found
