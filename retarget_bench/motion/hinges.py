"""The axes that knees and elbows bend about: of bodies in general, and of a rig by a sample of its motion.

Joint positions show in which plane an elbow is bent. How the upper arm is twisted then depends on where its
rig has the elbow's axis: CMU's is turned by 30 degrees about the arm against a T-pose that bends forward,
LAFAN's by some 20, others' by none. No position shows that, and rotations of any clip of the rig do.
"""

from collections.abc import Sequence

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.roles import SIDES, stands_on_four
from retarget_bench.motion.skeleton import Skeleton

HINGES = {
    "left_up_leg": np.array([1.0, 0.0, 0.0]),
    "right_up_leg": np.array([1.0, 0.0, 0.0]),
    "left_arm": np.array([0.0, -1.0, 0.0]),
    "right_arm": np.array([0.0, 1.0, 0.0]),
}
"""First joint of a limb -> the axis, in the reference pose, of a turn that folds knee or elbow."""
FOLDED = {
    role: tuple(f"{side}_{part}" for part in parts)
    for side in SIDES
    for role, parts in ((f"{side}_up_leg", ("leg", "foot")), (f"{side}_arm", ("forearm", "hand")))
}
"""First joint of a limb -> the roles of the two after it."""
_STRAIGHT, _BENT = 0.15, 0.4
"""Sine of a bend: from where its plane says something of the twist, from where it says all."""
_OFTEN = 0.1
"""Share of a sample in which elbows must be bent to show their axis."""
_ONE_AXIS = float(np.cos(np.radians(13.0)))
"""Length of the mean of unit axes: where they scatter more, the elbow is no hinge of the upper arm."""
_SOME = 500
"""Frames of a sample that are looked at."""
_MIRROR = np.array([1.0, -1.0, -1.0])
"""Factors that turn an axis of the left into that of the right."""


def measured(
    skeleton: Skeleton, roles: Sequence[str | None], pose: np.ndarray, sample: np.ndarray
) -> dict[str, np.ndarray]:
    """The axes that a rig's elbows bend about, in its reference pose, by role as in ``HINGES``.

    pose:   ``(joints, 4)`` local rotations of the reference pose.
    sample: ``(frames, joints, 4)`` local rotations of any motion of this body.

    One axis and its mirror image, ``(3,)`` units across the upper arms; {} where none is shown. Knees bend
    about the body's axis in all rigs that we know, and fore legs as they are folded at rest.
    """
    joint_of = {role: joint for joint, role in enumerate(roles) if role is not None}
    names = [(role, *FOLDED[role]) for role in (f"{side}_arm" for side in SIDES)]
    arms = [[joint_of.get(role, -1) for role in each] for each in names]
    rest, at_rest = kinematics.forward(skeleton, pose, np.zeros(3))
    if min(min(arm) for arm in arms) < 0 or not len(sample) or stands_on_four(rest, roles):
        return {}
    some = sample[:: 1 + (len(sample) - 1) // _SOME]
    places, turned = kinematics.forward(skeleton, some, np.zeros((len(some), 3)))
    total, weight = np.zeros(3), 0.0
    for (top, middle, end), mirror in zip(arms, (_MIRROR, np.ones(3)), strict=True):
        normal, share = bend(places[:, middle] - places[:, top], places[:, end] - places[:, middle])
        back = rotation.multiply(at_rest[top], rotation.conjugate(turned[:, top]))
        total += mirror * (share @ rotation.rotate(back, normal))
        weight += share.sum() / len(arms)
    size = float(np.linalg.norm(total)) / len(arms)
    if weight < _OFTEN * len(some) or size < _ONE_AXIS * weight:
        return {}
    bones = [rest[middle] - rest[top] for top, middle, _ in arms]
    return {
        f"{side}_arm": across(axis * total, bone)
        for side, axis, bone in zip(SIDES, (_MIRROR, np.ones(3)), bones, strict=True)
    }


def bend(upper: np.ndarray, lower: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The axis about which ``lower`` is turned from ``upper``, both ``(frames, 3)``: ``(frames, 3)`` units,
    and ``(frames,)`` how far, from 0 to 1, the bend is one that shows it."""
    normal = np.cross(upper, lower)
    size = np.linalg.norm(normal, axis=1)
    lengths = np.linalg.norm(upper, axis=1) * np.linalg.norm(lower, axis=1)
    sine = size / np.maximum(lengths, 1e-12)
    share = np.clip((sine - _STRAIGHT) / (_BENT - _STRAIGHT), 0.0, 1.0)
    return normal / np.maximum(size, 1e-12)[:, None], share


def across(axis: np.ndarray, bone: np.ndarray) -> np.ndarray:
    """``(3,)`` the part of an axis that is across a bone, of length 1; 0 where there is none."""
    along = bone / max(float(np.linalg.norm(bone)), 1e-12)
    rest = axis - along * (along @ axis)
    return np.asarray(rest / max(float(np.linalg.norm(rest)), 1e-12))
