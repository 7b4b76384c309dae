"""Sizes of a body, by the named definitions of the literature.

All are metres, told from bone lengths and the reference pose alone, never from a motion. A size that a body
does not have (no legs, no arms) is 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.roles import SIDES, bones
from retarget_bench.motion.skeleton import Skeleton


@dataclass(frozen=True)
class Measures:
    """Sizes of a body in metres.

    height:      role height: bone lengths from the hips to the last joint of the left leg (toe end, toe or
                 foot) plus those from the hips to the last joint of the head (head top or head). The
                 length that errors are divided by. Equal to ``h1`` where toe and head ends are joints.
    h1:          chain height of SAN and PAN: bones from the left toe end (or toe) and from the head end (or
                 head) up to the root; the root's own offset is left out.
    h2:          chain height of NKN, PMnet and R2ET: bones from the head to the hips and from the left toe
                 to the left upper leg; the bone from there to the hips, toe end and head end are left out.
    h4:          vertical extent in the reference pose, tips included.
    leg_length:  upper leg to foot, mean of both sides.
    arm_length:  upper arm to hand, mean of both sides.
    hip_height:  hips above the lowest point of the feet in the reference pose.
    hip_width:   distance of the two upper-leg joints.
    root_offset: the root's height in the rest pose as the file states it (y of its OFFSET).
    """

    height: float
    h1: float
    h2: float
    h4: float
    leg_length: float
    arm_length: float
    hip_height: float
    hip_width: float
    root_offset: float


def measure(skeleton: Skeleton, roles: Sequence[str | None], reference_pose: np.ndarray) -> Measures:
    """The sizes of a body.

    reference_pose: ``(joints, 4)`` local rotations of the common reference pose.
    A skeleton without the roles is measured along its longest chains instead.
    """
    joint = {role: index for index, role in enumerate(roles) if role is not None}
    hips, head = joint.get("hips", 0), _first(joint, "head_top", "head")
    foot = _first(joint, *(f"{side}_{part}" for side in SIDES for part in ("toe_end", "toe", "foot")))
    if foot is None and head is None:
        foot = max(range(len(skeleton)), key=lambda j: bones(skeleton, j, 0))
    places, turned = kinematics.forward(skeleton, reference_pose, np.zeros(3))
    tips = _tips(skeleton, places, turned)
    heights = np.concatenate([places[:, 1], tips[:, 1]])
    feet = {joint[role] for role in joint if role.endswith(("_foot", "_toe", "_toe_end"))}
    lowest = [places[j, 1] for j in feet]
    lowest += [tip[1] for site, tip in zip(skeleton.end_sites, tips, strict=True) if site.parent in feet]
    upper = [joint[f"{side}_up_leg"] for side in SIDES if f"{side}_up_leg" in joint]
    return Measures(
        height=bones(skeleton, foot, hips) + bones(skeleton, head, hips),
        h1=bones(skeleton, foot, 0) + bones(skeleton, head, 0),
        h2=bones(skeleton, _first(joint, "head"), hips)
        + bones(skeleton, _first(joint, "left_toe", "left_foot"), joint.get("left_up_leg")),
        h4=float(np.ptp(heights)),
        leg_length=_both(skeleton, joint, "foot", "up_leg"),
        arm_length=_both(skeleton, joint, "hand", "arm"),
        hip_height=float(places[hips, 1] - min(lowest)) if lowest else 0.0,
        hip_width=float(np.linalg.norm(places[upper[0]] - places[upper[1]])) if len(upper) == 2 else 0.0,
        root_offset=float(skeleton.offsets[0, 1]),
    )


def _tips(skeleton: Skeleton, places: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """``(end sites, 3)`` metres: the tips of the last bones, given the places ``(joints, 3)`` and world
    orientations ``(joints, 4)`` of the joints."""
    parents = np.array([site.parent for site in skeleton.end_sites], dtype=int)
    offsets = np.array([site.offset for site in skeleton.end_sites]).reshape(-1, 3)
    return np.asarray(places[parents] + rotation.rotate(turned[parents], offsets))


def _first(joint: dict[str, int], *roles: str) -> int | None:
    return next((joint[role] for role in roles if role in joint), None)


def _both(skeleton: Skeleton, joint: dict[str, int], end: str, start: str) -> float:
    """Bone length of a limb, mean over the sides that have it."""
    lengths = [bones(skeleton, joint.get(f"{side}_{end}"), joint.get(f"{side}_{start}")) for side in SIDES]
    positive = [length for length in lengths if length > 0]
    return float(np.mean(positive)) if positive else 0.0
