"""Roles that the tree of joints or the shape of a body contradicts, as those of a file that was filled in
wrongly: chains out of order, arms that are called legs, sides that are exchanged.

The motion shows the sides, not the rest pose, in which all bones may lie along one axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np

from retarget_bench.motion import role_aliases as aliases
from retarget_bench.motion import rotation
from retarget_bench.motion.body import UP
from retarget_bench.motion.character import Motion, Prediction
from retarget_bench.motion.role_aliases import NUMBERED_FINGERS
from retarget_bench.motion.role_structure import to_the_left
from retarget_bench.motion.roles import (
    LIMB_ROLES,
    SIDES,
    ancestors,
    body_part,
    common_ancestor,
    has_level_trunk,
    is_finger,
)
from retarget_bench.motion.skeleton import Skeleton

_SAMPLES = 200
"""Frames that are looked at."""
_CLEAR = 0.3
"""Distance of the mean sine from 0 beyond which a body is left- or right-handed."""
_BENT = np.radians(15.0)
"""Radians that a joint of no role may bend unnoticed."""
_MOST = 4
"""Contradictions in one sentence."""

Contradiction = tuple[tuple[str, ...], str]
"""The roles, and what speaks against them."""


def doubt(motion: Motion, overrides: Mapping[str, str | None], *, mirrored: bool = False) -> str:
    """A sentence on roles among ``overrides`` (joint name -> role, or None) that look wrong, or on sides
    that are exchanged; else "". mirrored: whether the file was, as the user said."""
    overridden = set(overrides.values())
    problems = [words for roles, words in contradictions(motion) if overridden.intersection(roles)]
    limbs = exchanged(motion)
    handed = "right-handed" if mirrored else "left-handed"
    mirror = "leave out mirror=true" if mirrored else "say mirror=true"
    if problems:
        more = f"; and {len(problems) - _MOST} more" if len(problems) > _MOST else ""
        more += f" (or is it {handed}? Then {mirror})" if " and " in limbs else ""
        return f"roles look wrong: {'; '.join(problems[:_MOST])}{more}: correct the table of roles"
    if not limbs:
        return ""
    return (
        f"left and right {limbs} are exchanged, by how knees and feet bend: is the file {handed}? Then "
        f"{mirror}; else correct the roles (roles=FILE)"
    )


def exchanged(motion: Prediction) -> str:
    """``arms``, ``legs``, or both, where the left ones are clearly to the right; else ""."""
    pairs = [pair for pair, sine in _sines(motion) if sine < -_CLEAR]
    return " and ".join("arms" if "arm" in pair[0] else "legs" for pair in pairs)


def contradictions(motion: Motion) -> list[Contradiction]:
    """All that speaks against the roles of a motion's body, what explains most first."""
    skeleton, joint = motion.skeleton, motion.character.joint_of
    return [
        *_carried(skeleton, joint),
        *_attached(skeleton, joint),
        *_sides(motion),
        *_chains(skeleton, joint),
        *_foreign(skeleton, joint),
    ]


def _chains(skeleton: Skeleton, joint: Mapping[str, int]) -> Iterator[Contradiction]:
    """Joints that do not hang below the one before them in a limb, finger, spine, neck or tail."""
    stems = ["spine", "neck", "tail", *(f"{side}_{each}" for side in SIDES for each in NUMBERED_FINGERS)]
    lines = [*LIMB_ROLES.values(), *(_numbered(joint, stem) for stem in stems)]
    lines += [(f"{role.split('_')[0]}_hand", role) for role in joint if is_finger(role)]
    for line in lines:
        for above, below in pairwise(role for role in line if role in joint):
            if joint[above] not in ancestors(skeleton, joint[below]):
                yield (above, below), f"{below} does not hang from {above}"


def _numbered(joint: Mapping[str, int], stem: str) -> list[str]:
    """``spine_1``, ``spine_2``, ... that there are."""
    numbers = (role.removeprefix(f"{stem}_") for role in joint if role.startswith(f"{stem}_"))
    return [f"{stem}_{number}" for number in sorted(int(each) for each in numbers if each.isdecimal())]


def _carried(skeleton: Skeleton, joint: Mapping[str, int]) -> Iterator[Contradiction]:
    """Parts of the body that the hips do not carry."""
    starts = ("spine_1", "head", *(f"{side}_{part}" for part in ("arm", "up_leg") for side in SIDES))
    hips = joint.get("hips")
    loose = [role for role in starts if role in joint and hips not in ancestors(skeleton, joint[role])]
    if hips is not None and loose:
        yield ("hips", *loose), f"hips does not carry {', '.join(loose)}"


def _foreign(skeleton: Skeleton, joint: Mapping[str, int]) -> Iterator[Contradiction]:
    """Joints of one part of the body that hang from another one, which carries nothing else."""
    role_of = {index: role for role, index in joint.items()}
    for role, index in joint.items():
        above = next((role_of[each] for each in ancestors(skeleton, index) if each in role_of), "hips")
        ends = body_part(above) not in ("trunk", body_part(role)) and not above.startswith("neck")
        if ends and not (is_finger(role) and above.endswith("_hand")):
            yield (role, above), f"{role} hangs from {above}"


def _attached(skeleton: Skeleton, joint: Mapping[str, int]) -> Iterator[Contradiction]:
    """Arms that leave the way from the hips to the head before the legs do."""
    early: list[str] = []
    for side in SIDES:
        arm, leg = f"{side}_arm", f"{side}_up_leg"
        if {"head", arm, leg} <= joint.keys():
            high, low = (common_ancestor(skeleton, [joint[each], joint["head"]]) for each in (arm, leg))
            if high is not None and low is not None and high in ancestors(skeleton, low):
                early += [arm, leg]
    if early:
        arms, legs = (" and ".join(early[first::2]) for first in (0, 1))
        begin = "begins" if len(early) == 2 else "begin"
        yield tuple(early), f"{arms} {begin} below {legs}, as if exchanged"


def left_out(motion: Motion) -> tuple[str, ...]:
    """A sentence for each bone of trunk, neck and limbs inside which joints of no role bend: no method
    drives these.

    A joint that turns about its bone alone, as twist bones do, does not bend.
    """
    skeleton, roles = motion.skeleton, motion.character.roles
    sample = motion.at(np.unique(np.linspace(0, motion.frames - 1, _SAMPLES).astype(int)))
    sentences: list[str] = []
    for role, joint in motion.character.joint_of.items():
        over = ancestors(skeleton, joint)
        count = next((k for k, above in enumerate(over) if roles[above] is not None), None)
        if count is None or is_finger(role):
            continue
        top, inside = over[count], over[:count]
        parts = {body_part(role), body_part(str(roles[top]))}
        angles = [_bend(sample, above, below) for below, above in pairwise((joint, *inside))]
        bent = [skeleton.names[each] for each, angle in zip(inside, angles, strict=True) if angle > _BENT]
        if bent and (len(parts) == 1 or parts == {"trunk", "head"}):
            turn, are = ("turns", "is") if len(bent) == 1 else ("turn", "are")
            sentences.append(
                f"{skeleton.names[top]} to {skeleton.names[joint]}: {' and '.join(bent[::-1])} {turn} by "
                f"up to {np.degrees(max(angles)):.0f} degrees and {are} left out: say what they are "
                "(roles=FILE)"
            )
    return tuple(sentences)


def _bend(motion: Motion, joint: int, below: int) -> float:
    """Radians by which the bone from a joint to one below it turns away from its first direction; without a
    length, by which the joint turns."""
    rotations, bone = motion.rotations[:, joint], rotation.unit(motion.skeleton.offsets[below])
    if not bone.any():
        return float(rotation.angle(rotations[:1], rotations).max())
    directions = rotation.rotate(rotations, bone)
    return float(np.arccos(np.clip(directions @ directions[0], -1.0, 1.0)).max())


# ------------------------------------------------------------------------------------------------- sides
def _sides(motion: Motion) -> Iterator[Contradiction]:
    """Pairs of limbs whose left is where the right has to be, by how legs bend; where these do not tell, by
    the names of the joints."""
    names = aliases.read(motion.skeleton.names)
    for pair, sine in _sines(motion):
        sides = [names[each].side for each in motion.character.joints(pair)]
        if sine < -_CLEAR or (sine < _CLEAR and sides == list(SIDES[::-1])):
            yield pair, f"{pair[0]} and {pair[1]} are on the other side"


def _sines(motion: Prediction) -> Iterator[tuple[tuple[str, str], float]]:
    """Pairs of limbs, and how far their left one is to the left: about 1 where sides are right, -1 where
    they are exchanged, 0 where the body does not tell.

    Legs of people tell it by how they bend. Those of animals bend one way at the knee and the other at the
    hock, and may lack either, but their trunk lies the way that they face.
    """
    sample = motion.at(np.unique(np.linspace(0, motion.frames - 1, _SAMPLES).astype(int)))
    level = has_level_trunk(motion.skeleton, motion.character.roles)
    left = _beside_the_trunk(sample) if level else _beside_the_legs(sample)
    for part in ("arm", "up_leg"):
        pair = f"left_{part}", f"right_{part}"
        joints = sample.character.joints(pair)
        if len(joints) == len(pair):
            apart = sample.positions[:, joints[0]] - sample.positions[:, joints[1]]
            yield pair, float((rotation.unit(apart) * left).sum(axis=1).mean())


def _beside_the_trunk(motion: Prediction) -> np.ndarray:
    """``(frames, 3)`` the left of a body whose trunk is level."""
    ends = ("head", "neck", *(f"{side}_{part}" for side in SIDES for part in ("shoulder", "arm")))
    front = motion.positions[:, motion.character.joints(ends)].mean(axis=1)
    hips = motion.positions[:, motion.character.joint_of["hips"]]
    return rotation.unit(np.cross(UP, front - hips))


def _beside_the_legs(motion: Prediction) -> np.ndarray:
    """``(frames, 3)`` the left by how legs bend: see ``to_the_left``."""
    parts = ("up_leg", "leg", "foot", "toe")
    legs = (motion.character.joints([f"{side}_{part}" for part in parts]) for side in SIDES)
    return to_the_left([[motion.positions[:, joint] for joint in leg] for leg in legs])
