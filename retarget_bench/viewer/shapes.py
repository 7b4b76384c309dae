"""How thick a drawn body is: joints are points, and people are not."""

from __future__ import annotations

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import body_part, is_finger, is_tip

LIMBS = {
    "up_leg": (0.044, 0.046),
    "leg": (0.046, 0.029),
    "foot": (0.029, 0.019),
    "toe": (0.021, 0.015),
    "shoulder": (0.048, 0.038),
    "arm": (0.034, 0.031),
    "forearm": (0.029, 0.021),
    "hand": (0.021, 0.015),
}
"""What a bone ends in, without its side -> its radii at both ends, in heights."""
PARTS = {"trunk": (0.058, 0.062), "head": (0.03, 0.028), "tail": (0.015, 0.009)}
FINGER = (0.007, 0.006)
HEAD = 0.052
"""Radius of a head, in heights."""
PLAIN = 0.14
"""Radius of a bone that has no role, in its own length."""
THINNEST = 0.004
"""No bone without a role is thinner than this, in heights: long chains of short bones would be hairs."""
THICKEST = 0.42
"""No limb is thicker than this, in its own length: short bones would be balls."""


def radii(body: Character) -> np.ndarray:
    """``(joints, 2)`` metres: of the bone to each joint, at its parent and at itself; 0 for roots."""
    found = np.zeros((len(body.roles), 2))
    lengths = body.skeleton.bone_lengths
    for joint, role in enumerate(body.roles):
        length = float(lengths[joint])
        if body.skeleton.parents[joint] < 0 or length == 0.0:
            continue
        if role is None or is_tip(role):
            parent = body.skeleton.parents[joint]
            widest = found[parent, 1] or 0.03 * body.height
            found[joint] = max(min(PLAIN * length, widest), THINNEST * body.height)
            continue
        found[joint] = np.multiply(_share(role), body.height)
        if body_part(role) not in ("trunk", "head"):
            found[joint] = np.minimum(found[joint], THICKEST * length)
    return found


def heads(body: Character) -> list[tuple[int, int, float]]:
    """Of each head its joint, the joint that says where it points from, and its radius in metres."""
    joint = body.joint_of.get("head")
    if joint is None or body.skeleton.parents[joint] < 0:
        return []
    return [(joint, int(body.skeleton.parents[joint]), HEAD * body.height)]


def sides(body: Character) -> str:
    """One letter per joint: ``l`` or ``r`` for what is on a side, ``-`` for the rest.

    Joints without roles take the side of what they hang from.
    """
    found: list[str] = []
    for parent, role in zip(body.skeleton.parents.tolist(), body.roles, strict=True):
        if role is not None:
            found.append({"left": "l", "right": "r"}.get(role.partition("_")[0], "-"))
        else:
            found.append(found[parent] if parent >= 0 else "-")
    return "".join(found)


def ends(body: Character) -> list[int]:
    """Joints whose way through the air tells a motion: hands, feet and head, else every last joint."""
    told = body.joints(("left_hand", "right_hand", "left_foot", "right_foot", "head"))
    return told or [joint for joint, below in enumerate(body.skeleton.children) if not below]


def _share(role: str) -> tuple[float, float]:
    """Radii of the bone that ends in a role, in heights."""
    if is_finger(role):
        return FINGER
    limb = role.partition("_")[2]
    return LIMBS[limb] if limb in LIMBS else PARTS.get(body_part(role), PARTS["trunk"])
