"""Neutral poses: a body that stands with its arms along it, as templates of skeletons show it.

Some methods learn what a skeleton is from such a pose (HuMoT, section 3.2, whose authors set one by hand
for every data set). Roles and the common reference pose give one for any body.
"""

from itertools import pairwise

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import kinematics
from retarget_bench.motion.body import DOWN, PosedBody
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import SIDES


def neutral_pose(character: Character) -> np.ndarray:
    """``(joints, 4)`` local rotations: the reference pose with both arms hanging straight down.

    Hands and what has no role keep to their parents. On four legs it is the reference pose.
    """
    pose = np.array(character.reference_pose)
    if character.four_legged:
        return pose
    body = PosedBody(character.skeleton, character.roles)
    for side in SIDES:
        joints = body.joints(*(f"{side}_{part}" for part in ("arm", "forearm", "hand")))
        for joint, child in pairwise(joints):
            body.swing(pose, joint, child, DOWN)
    return pose


def template(character: Character) -> np.ndarray:
    """``(joints, 3)`` metres: the neutral pose with the hips at the origin, Y up, facing +Z, left is +X.

    Of a part of a body, the whole body's at its joints. Raises SkeletonError where there are no hips.
    """
    if character.whole is not None:
        names = character.whole.skeleton.names
        return template(character.whole)[[names.index(name) for name in character.skeleton.names]]
    hips = character.joint_of.get("hips", -1)
    if hips < 0:
        raise SkeletonError(f"no joint of {character.name} is known as hips; name it in a roles file")
    places = kinematics.forward(character.skeleton, neutral_pose(character), np.zeros(3))[0]
    return np.asarray(places - places[hips])
