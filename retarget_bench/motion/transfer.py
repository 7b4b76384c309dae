"""Carrying a pose from one body to another: what the untrained methods share."""

import numpy as np

from retarget_bench.errors import NotSupported
from retarget_bench.motion import alignment, correspondence, kinematics, root_rules
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, Positions

ESSENTIAL = ("hips",)
"""Roles without which no pose can be carried."""


def reason(source: Character, target: Character) -> str | None:
    """None, or why no pose can be carried between these bodies, as a sentence."""
    for body in (source, target):
        if missing := [role for role in ESSENTIAL if role not in body.joint_of]:
            return f"no joint of {body.name} is known as {', '.join(missing)}; name it in a roles file"
    shared = set(source.joint_of) & set(target.joint_of)
    if len(shared) < 2:
        return f"{source.name} and {target.name} share no roles but the hips"
    return None


def orientations(source: Motion, target: Character) -> np.ndarray:
    """``(frames, joints of target, 4)`` world orientations relative to the common reference pose.

    A joint of the target takes that of its counterpart; one without counterpart stays fixed to its parent,
    as in the reference pose.
    """
    return correspondence.carry(alignment.relative(source), source.character, target)


def hips(source: Motion | Positions) -> np.ndarray:
    """``(frames, 3)`` metres: the joint with the role ``hips``, which need not be the root."""
    joint = source.character.joint_of["hips"]
    return source.root if joint == 0 else source.positions[:, joint]


def root_from_hips(target: Character, rotations: np.ndarray, place: np.ndarray) -> np.ndarray:
    """``(frames, 3)`` root that brings the hips to ``place`` ``(frames, 3)`` in these rotations."""
    joint = target.joint_of["hips"]
    if joint == 0:
        return place
    places, _ = kinematics.forward(target.skeleton, rotations, np.zeros_like(place))
    return place - places[:, joint]


def scaled_root(
    source: Motion | Positions,
    target: Character,
    rotations: np.ndarray,
    rule: str,
    reference: Motion | Positions | None = None,
) -> np.ndarray:
    """``(frames, 3)`` metres: the target's root path under a root rule (``root_rules.ROOT_RULES``).

    rotations: ``(frames, joints, 4)`` the target's, needed where the hips are not the root.
    reference: whose path the rule ``reference`` takes. Raises NotSupported where that is missing.
    """
    if rule == "reference":
        if reference is None:
            raise NotSupported("root rule reference needs a reference motion, and this case has none")
        return reference.root
    ratio = root_rules.ratio(rule, source.character, target)
    return root_from_hips(target, rotations, hips(source) * ratio)


def carry(
    source: Motion, target: Character, rule: str, reference: Motion | Positions | None = None
) -> Motion:
    """The source's pose on the target: orientations copied relative to the reference pose, root by rule."""
    local = alignment.from_relative(target, orientations(source, target))
    root = scaled_root(source, target, local, rule, reference)
    return target.motion(local, root, source.fps)
