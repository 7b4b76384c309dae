"""Roles of joints: what they mean in anatomy.

A role is a word such as ``hips``, ``spine_2`` or ``left_forearm``; ``role_finding.py`` finds them. Helpers
between two bones (``Pelvis``, ``Spine1_split``), props, hair and the face have no role: they follow their
parent. A TOML file of ``"joint name" = "role"`` (``"none"`` for no role) overrides all of this.
"""

import difflib
import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from retarget_bench.motion import role_aliases as aliases
from retarget_bench.motion.role_aliases import LIMBS, NUMBERED_FINGERS
from retarget_bench.motion.skeleton import Skeleton

Roles = tuple[str | None, ...]

SIDES = ("left", "right")
HANDS = ("left_hand", "right_hand")
END_EFFECTORS = ("head", "left_hand", "right_hand", "left_foot", "left_toe", "right_foot", "right_toe")
ESSENTIAL = (
    "hips",
    "head",
    *(f"{side}_{part}" for side in SIDES for part in ("arm", "forearm", "hand", "up_leg", "leg", "foot")),
)
"""Without these a body cannot be retargeted by anatomy."""

LIMB_ROLES: dict[str, tuple[str, ...]] = {
    f"{side}_{limb}": tuple(f"{side}_{part}" for part in parts)
    for limb, parts in LIMBS.items()
    for side in SIDES
}
"""``left_arm`` -> its roles from the body outwards; likewise ``right_arm``, ``left_leg``, ``right_leg``."""

_FORE_LEG, _OFF_FLOOR = 0.35, 0.5
"""Shares of the legs: fore legs reach down at least so far, and end at most so far above the feet; wings
and short arms do not."""
_SEATED = -0.5
"""Cosine of trunk and legs below which a body on two legs without a tail is upright."""
_NUMBERED = re.compile(r"^(spine|neck|tail|(left|right)_(thumb|index|middle|ring|pinky))_\d+$")
_PLAIN = frozenset(("hips", "neck", "head", "head_top")).union(*LIMB_ROLES.values())


def is_role(word: str) -> bool:
    """True for a role's name."""
    return word in _PLAIN or _NUMBERED.match(word) is not None


def is_finger(role: str | None) -> bool:
    return role is not None and any(f"_{finger}_" in role for finger in NUMBERED_FINGERS)


def is_tip(role: str | None) -> bool:
    """True for the end of a last bone, which some files write as a joint."""
    return role is not None and (role == "head_top" or role.endswith("_end"))


def is_body(role: str | None) -> bool:
    """True for roles of the body, fingers left out."""
    return role is not None and not is_finger(role)


def body_part(role: str) -> str:
    """``trunk``, ``head``, ``tail``, ``left_arm``, ``right_arm``, ``left_leg`` or ``right_leg``."""
    if is_finger(role):
        return f"{role.split('_')[0]}_arm"
    for part, chain in LIMB_ROLES.items():
        if role in chain:
            return part
    if role.startswith("tail"):
        return "tail"
    return "head" if role.startswith(("neck", "head")) else "trunk"


BODY_PARTS = ("trunk", "head", "left_arm", "right_arm", "left_leg", "right_leg", "tail")


def chain(roles: Sequence[str | None], stem: str) -> list[int]:
    """The joints of ``spine``, ``neck`` or ``tail`` from the hips outwards; a lone ``neck`` counts."""
    links = {}
    for joint, role in enumerate(roles):
        if role == stem:
            links[1] = joint
        elif role is not None and re.fullmatch(rf"{stem}_\d+", role):
            links[int(role.rsplit("_", 1)[1])] = joint
    return [links[number] for number in sorted(links)]


def no_role(word: str) -> str:
    """A sentence on a word that is no role."""
    near = difflib.get_close_matches(word, sorted(_PLAIN), 3) or sorted(_PLAIN)
    return f"{word!r} is no role; near it: {', '.join(near)}"


# -------------------------------------------------------------------------------------------- the tree
def ancestors(skeleton: Skeleton, joint: int, *, itself: bool = False) -> list[int]:
    """Parent, grandparent, ... up to the root; the joint first with ``itself``."""
    line = [joint] if itself else []
    while (joint := int(skeleton.parents[joint])) >= 0:
        line.append(joint)
    return line


def bones(skeleton: Skeleton, joint: int | None, top: int | None) -> float:
    """Metres of bones from ``joint`` up to ``top``; 0 where either is missing or not above."""
    if joint is None or top is None:
        return 0.0
    line = ancestors(skeleton, joint, itself=True)
    return float(skeleton.bone_lengths[line[: line.index(top)]].sum()) if top in line else 0.0


def common_ancestor(skeleton: Skeleton, joints: Sequence[int]) -> int | None:
    """The deepest joint that every one of these hangs below (or is)."""
    shared = set.intersection(*(set(ancestors(skeleton, joint, itself=True)) for joint in joints))
    return max(shared, default=None)


def is_quadruped(skeleton: Skeleton, roles: Sequence[str | None]) -> bool:
    """True for a body on four legs, judged without its reference pose (see ``Character.four_legged``).

    Its trunk is level, and its fore legs, which have the roles of arms, reach down as its legs do.
    """
    rest = skeleton.rest_positions
    return stands_on_four(rest, roles) or (not _crossed(rest, roles) and has_level_trunk(skeleton, roles))


def has_level_trunk(skeleton: Skeleton, roles: Sequence[str | None]) -> bool:
    """True for a body whose trunk lies along the floor: on four legs, or on two, as birds are.

    Its trunk and legs cross in the rest pose (on two legs without a tail clearly: people may rest
    seated); or else (bones all along one axis) it has a tail, and a trunk at least as long as its legs.
    """
    rest, lines = skeleton.rest_positions, _trunk_and_legs(skeleton.rest_positions, roles)
    tailed = any(role is not None and role.startswith("tail") for role in roles)
    if lines is not None and _crossed(rest, roles):
        return tailed or stands_on_four(rest, roles) or _cosine(*lines) > _SEATED
    if lines is None or not tailed:
        return False
    joint = {role: index for index, role in enumerate(roles) if role is not None}
    side = next(side for side in SIDES if {f"{side}_up_leg", f"{side}_foot"} <= joint.keys())
    reach = bones(skeleton, joint[f"{side}_foot"], joint[f"{side}_up_leg"])
    return _cosine(*lines) >= 0.5 and float(np.linalg.norm(lines[0])) > 0.9 * reach


def stands_on_four(places: np.ndarray, roles: Sequence[str | None]) -> bool:
    """True where trunk and unfolded legs cross and fore legs reach down along the legs, with joints at
    ``places`` ``(joints, 3)`` metres."""
    lines = _trunk_and_legs(places, roles)
    if lines is None or not _crossed(places, roles):
        return False
    joint = {role: index for index, role in enumerate(roles) if role is not None}
    limbs = [[f"{side}_{part}" for part in ("arm", "hand", "foot")] for side in SIDES]
    fore = [places[[joint[role] for role in limb]] for limb in limbs if joint.keys() >= set(limb)]
    if not fore:
        return any(f"{side}_arm" in joint for side in SIDES)
    top, hand, foot = np.mean(fore, axis=0) @ lines[1] / float(lines[1] @ lines[1])
    return bool(hand - top > _FORE_LEG and foot - hand < _OFF_FLOOR)


def _crossed(places: np.ndarray, roles: Sequence[str | None]) -> bool:
    """True where trunk and unfolded legs cross."""
    lines = _trunk_and_legs(places, roles)
    if lines is None:
        return False
    joint = {role: index for index, role in enumerate(roles) if role is not None}
    reach = [
        sum(
            np.linalg.norm(places[joint[low]] - places[joint[high]])
            for high, low in pairwise(f"{side}_{part}" for part in ("up_leg", "leg", "foot"))
            if high in joint and low in joint
        )
        for side in SIDES
    ]
    return -0.75 < _cosine(*lines) < 0.5 and bool(np.linalg.norm(lines[1]) > 0.5 * max(reach))


def _trunk_and_legs(
    places: np.ndarray, roles: Sequence[str | None]
) -> tuple[np.ndarray, np.ndarray] | None:
    """``(3,)`` each: from the hips to the shoulders (without arms, to the neck) and down the legs; None for
    a body without either."""
    joint = {role: index for index, role in enumerate(roles) if role is not None}
    limbs = [(f"{side}_up_leg", f"{side}_foot") for side in SIDES]
    limbs = [pair for pair in limbs if pair[0] in joint and pair[1] in joint]
    arms = [joint[r] for r in ("left_arm", "right_arm", "left_shoulder", "right_shoulder") if r in joint]
    arms = arms or [joint[role] for role in ("neck", "neck_1") if role in joint]
    if "hips" not in joint or not limbs or not arms:
        return None
    legs = np.mean([places[joint[foot]] - places[joint[top]] for top, foot in limbs], axis=0)
    return places[arms].mean(axis=0) - places[joint["hips"]], legs


def _cosine(a: np.ndarray, b: np.ndarray) -> float:
    return float(a @ b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-12)


# ---------------------------------------------------------------------------------------- explanations
def explain(skeleton: Skeleton, roles: Sequence[str | None]) -> tuple[str, ...]:
    """Per joint its role, or why it has none: ``helper`` (of the body: it follows its parent), ``extra``
    (clothes, hair, props, face), ``above the hips`` or ``not understood``."""
    by_role = {role: joint for joint, role in enumerate(roles) if role is not None}
    over = set(ancestors(skeleton, by_role["hips"])) if "hips" in by_role else set()
    carries = {j for joint in by_role.values() for j in ancestors(skeleton, joint)}
    out: list[str] = []
    for joint, (name, role) in enumerate(zip(aliases.read(skeleton.names), roles, strict=True)):
        words = set(name.words)
        if role is not None:
            out.append(role)
        elif joint in over:
            out.append("above the hips")
        elif joint in carries:
            out.append("helper")
        elif words & aliases.EXTRA_WORDS or (joint > 0 and out[skeleton.parents[joint]] == "extra"):
            out.append("extra")
        else:
            helper = words & aliases.HELPER_WORDS or (name.side and name.stem in aliases.LIMB_STEMS)
            out.append("helper" if helper else "not understood")
    return tuple(out)


def in_order(skeleton: Skeleton, roles: Sequence[str | None]) -> bool:
    """True where the joints of every limb hang below each other in anatomical order."""
    joint = {role: index for index, role in enumerate(roles) if role is not None}
    lines = ([joint[role] for role in limb if role in joint] for limb in LIMB_ROLES.values())
    return all(a in ancestors(skeleton, b) for line in lines for a, b in pairwise(line))
