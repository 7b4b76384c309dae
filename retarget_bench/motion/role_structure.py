"""Roles of joints by the tree, the symmetry of sides, lengths and places alone, where names say nothing.

Two pairs of like branches are the legs and the arms (``role_limbs.py``). The arms hang farther from the
root, and a line in the middle leads on from there to the head. Left and right are told by how a body folds:
hips and elbows forwards, knees backwards, feet forwards.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, permutations

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.role_aliases import LIMBS, read
from retarget_bench.motion.role_limbs import Limb, Line, Tree
from retarget_bench.motion.roles import ESSENTIAL, SIDES, Roles, ancestors, common_ancestor
from retarget_bench.motion.skeleton import Skeleton

_CANDIDATES = 8
"""Pairs of limbs that are compared with each other."""
_LEAST = 3
"""Joints of a limb."""
_FARTHER = 1.2
"""Factor for arms that hang farther from the root than the legs."""
_SHORT = 0.05
"""Share of the longest bone of neck and head below which another is none."""
_TOP_OF_HEAD = (1.2, 0.4)
"""A last bone so much longer than the one before it, and than a forearm, is that from a head to its top."""
_TAIL = 2
"""Least joints of a tail."""
_FOLDED = -0.8
"""Cosine of trunk and thigh to which hips fold; beyond it, all bones lie along one axis."""
_CLEAR, _LIKELY = 0.2, 0.2
"""Mean sine beyond which it is clear where the left is, and margin beyond which limbs are clear."""


@dataclass(frozen=True)
class Guess:
    """Role -> joint, of the main joints of a body, and how clear these are.

    limbs: share by which the arms and legs are better than the next best.
    sides: the mean sine of the folds that tell left from right: over 1 where feet point forwards, 0 where
        nothing tells it. Then the left is taken to be where most files have it.
    """

    joint_of: dict[str, int]
    limbs: float
    sides: float

    @property
    def confidence(self) -> str:
        """How clear it is, in words."""
        limbs = sides = "likely" if self.limbs > _LIKELY else "doubtful"
        if self.sides <= _CLEAR:
            sides = "not told by how it stands, perhaps exchanged"
        return f"arms and legs: {limbs}; left and right: {sides}"

    @property
    def exchanged(self) -> dict[str, int]:
        """The same joints with left and right exchanged."""
        other = dict(zip(SIDES, SIDES[::-1], strict=True))
        parts = ((role.partition("_"), joint) for role, joint in self.joint_of.items())
        return {other.get(side, side) + line + part: joint for (side, line, part), joint in parts}


def completed(
    skeleton: Skeleton, roles: Sequence[str | None], places: np.ndarray, explicit: Container[str] = ()
) -> tuple[Roles, str]:
    """Roles with a guess of those that are missing, where essential ones are and nothing contradicts it;
    and how clear that is, "" where none were guessed.

    places: ``(frames, joints, 3)`` of any poses. explicit: names of joints that keep what they have.
    """
    joint_of = {role: joint for joint, role in enumerate(roles) if role is not None}
    found = None if joint_of.keys() >= set(ESSENTIAL) else guess(skeleton, places)
    if found is None:
        return tuple(roles), ""
    if side := _side_by_names(skeleton, found.joint_of):
        found = replace(found, joint_of=found.joint_of if side > 0 else found.exchanged, sides=1.0)
    for guessed in (found.joint_of, found.exchanged):
        free = {
            joint: role
            for role, joint in guessed.items()
            if role not in joint_of and roles[joint] is None and skeleton.names[joint] not in explicit
        }
        known = (role for role in guessed.keys() & joint_of.keys() if role in ESSENTIAL)
        if free and all(joint_of[role] == guessed[role] for role in known):
            return tuple(free.get(joint, role) for joint, role in enumerate(roles)), found.confidence
    return tuple(roles), ""


def _side_by_names(skeleton: Skeleton, joint_of: Mapping[str, int]) -> int:
    """1 where the sides that most names state are those of the roles, -1 where they are the other ones; 0
    where most names state none."""
    names = read(skeleton.names)
    sides = [(role.partition("_")[0], names[joint].side) for role, joint in joint_of.items()]
    votes = [(side == named) - (side != named) for side, named in sides if named and side in SIDES]
    most = sum(side in SIDES for side, _ in sides) / 2
    return int(np.sign(sum(votes))) if abs(sum(votes)) > most else 0


def guess(skeleton: Skeleton, places: np.ndarray) -> Guess | None:
    """The main joints of a body; None of a tree that has no arms, legs and head.

    places: ``(frames, joints, 3)`` of any poses, which show where the left is.
    """
    tree = Tree(skeleton, places)
    found = _legs_and_arms(tree)
    if found is None:
        return None
    legs, arms, head = found
    carrier = tree.parent(arms.lines)
    hips = common_ancestor(skeleton, [carrier, tree.parent(legs.lines)])
    assert hips is not None  # the root is above all
    spine = ancestors(skeleton, carrier, itself=True)
    roles = {"hips": hips, "head": head[-1]}
    roles |= _numbered("spine", spine[: spine.index(hips)][::-1]) | _numbered("neck", head[:-1])
    first, clear = _left(tree, legs, arms, hips)
    for limb, parts in ((legs, LIMBS["leg"]), (arms, LIMBS["arm"][1:])):
        for side, line in zip(SIDES, limb.lines[:: first[limb is arms]], strict=True):
            ends = line[limb.end :] if limb is legs else line[limb.end : limb.end + 1]
            joints = [line[limb.start], line[limb.bend], *ends]
            roles |= {f"{side}_{part}": joint for part, joint in zip(parts, joints, strict=False)}
            if limb is arms and limb.start > 0:
                roles[f"{side}_shoulder"] = line[tree.collar(limb) or 0]
    roles |= _numbered("tail", _tail(tree, legs, hips, set(roles.values())))
    return Guess(roles, min(legs.margin, arms.margin), clear)


def _numbered(stem: str, joints: Line) -> dict[str, int]:
    if stem == "neck" and len(joints) == 1:
        return {"neck": joints[0]}
    return {f"{stem}_{number}": joint for number, joint in enumerate(joints, 1)}


# --------------------------------------------------------------------------------------------- the tree
def _legs_and_arms(tree: Tree) -> tuple[Limb, Limb, Line] | None:
    """The best legs and arms, neither of which hang from the other, and the line of neck and head."""
    best: tuple[float, Limb, Limb, Line] | None = None
    pairs = [pair for pair in tree.pairs if len(pair[0]) >= _LEAST]
    pairs.sort(key=lambda pair: -tree.way(pair[0][0]))
    fits = [(tree.limb(pair, "leg"), tree.limb(pair, "arm")) for pair in pairs[:_CANDIDATES]]
    for (legs, _), (_, arms) in permutations(fits, 2):
        if legs is None or arms is None:
            continue
        carriers = tree.parent(legs.lines), tree.parent(arms.lines)
        if {*legs.joints, *arms.joints}.intersection(carriers):
            continue
        head = _head(tree, arms)
        hips = common_ancestor(tree.skeleton, carriers)
        if not head or hips is None or not _above(tree, legs, arms, head[0]):
            continue
        depths = [len(ancestors(tree.skeleton, joint)) for joint in carriers]
        score = (legs.score + arms.score) * (_FARTHER if depths[1] > depths[0] else 1.0)
        if best is None or score > best[0]:
            best = score, legs, arms, head
    return best and best[1:]


def _above(tree: Tree, legs: Limb, arms: Limb, head: int) -> bool:
    """Whether arms hang from above the hips; of limbs that all hang from one joint, whether they are nearer
    to where the neck begins."""
    carriers = [tree.parent(limb.lines) for limb in (legs, arms)]
    if carriers[0] != carriers[1]:
        return common_ancestor(tree.skeleton, carriers) != carriers[1]
    starts = [tree.places[:, limb.lines[0][0]] - tree.places[:, head] for limb in (legs, arms)]
    far_legs, far_arms = (np.linalg.norm(start, axis=1).mean() for start in starts)
    return bool(far_arms < far_legs)


def _head(tree: Tree, arms: Limb) -> Line:
    """The line of neck and head: from the joint in the middle between the arms to where it branches."""
    skeleton = tree.skeleton
    beside = skeleton.children[tree.parent(arms.lines)]
    below = [child for child in beside if tree.in_the_middle(child, arms)]
    if not below:
        return []
    line = tree.single(max(below, key=tree.way))
    least = _SHORT * skeleton.bone_lengths[line].max()
    line = line[:1] + [joint for joint in line[1:] if skeleton.bone_lengths[joint] > least]
    return line[:-1] if _ends_in_a_tip(tree, line, arms) else line


def _ends_in_a_tip(tree: Tree, line: Line, arms: Limb) -> bool:
    """Whether the last joint of neck and head is the top of the head."""
    skeleton = tree.skeleton
    if len(line) < 3 or skeleton.children[line[-1]]:
        return False
    tips = {site.parent: np.linalg.norm(site.offset) for site in skeleton.end_sites}
    if tips.get(line[-1]) == 0 and any(length > 0 for length in tips.values()):
        return True
    before, last = skeleton.bone_lengths[line[-2:]]
    forearm = skeleton.bone_lengths[arms.lines[0][arms.bend + 1 : arms.end + 1]].sum()
    return bool(last > max(_TOP_OF_HEAD[0] * before, _TOP_OF_HEAD[1] * forearm))


def _tail(tree: Tree, legs: Limb, hips: int, known: Container[int]) -> Line:
    """The one line in the middle, besides the spine, that hangs from the hips or what carries them."""
    lines = []
    for above in ancestors(tree.skeleton, hips, itself=True):
        for start in tree.skeleton.children[above]:
            line = tree.single(start)
            ends = not tree.skeleton.children[line[-1]] and not any(joint in known for joint in line)
            if ends and len(line) >= _TAIL and tree.in_the_middle(start, legs):
                lines.append(line)
    return lines[0] if len(lines) == 1 else []


# -------------------------------------------------------------------------------------------- the sides
def to_the_left(legs: Sequence[Sequence[np.ndarray]]) -> np.ndarray:
    """``(frames, 3)`` where the left is, of bodies on two legs and on four, whichever leg is which.

    Knees bend backwards and feet point forwards against their shanks in every pose: the axis of these bends
    points left. The mean over legs, as long as the sine of the bends; zero without legs.

    legs: each the places ``(frames, 3)`` of hip, knee, ankle and toe, as far as there are.
    """
    bends = []
    for leg in legs:
        bones = [rotation.unit(low - high) for high, low in pairwise(leg[:4])]
        bends += [
            sign * np.cross(upper, lower)
            for sign, (upper, lower) in zip((1.0, -1.0), pairwise(bones), strict=False)
        ]
    return np.sum(bends, axis=0) / 2 if bends else np.zeros(3)


def _left(tree: Tree, legs: Limb, arms: Limb, hips: int) -> tuple[tuple[int, int], float]:
    """For legs and arms 1 where the first line of the pair is the left one, else -1; and how clear that is
    (see ``Guess``).

    Hips and elbows fold forwards, besides what ``to_the_left`` says of knees and feet. Where that is not
    clear, the left is taken to be along the positive axis, as X is in files that face +Z with Y up, or -Y
    with Z up.
    """
    places = tree.places
    feet = ([line[legs.start], line[legs.bend], *line[legs.end : legs.end + 2]] for line in legs.lines)
    left = to_the_left([[places[:, joint] for joint in leg] for leg in feet])
    chest = tree.parent(arms.lines)
    above = places[:, [line[arms.start] for line in arms.lines] if chest == hips else [chest]].mean(axis=1)
    trunk = rotation.unit(places[:, hips] - above)
    for leg, arm in zip(legs.lines, arms.lines, strict=True):
        bones = (
            (leg[legs.start], leg[legs.bend]),
            *pairwise(arm[j] for j in (arms.start, arms.bend, arms.end)),
        )
        thigh, upper, lower = (rotation.unit(places[:, low] - places[:, high]) for high, low in bones)
        folded = (trunk * thigh).sum(axis=1, keepdims=True) > _FOLDED
        left = left - folded * np.cross(trunk, thigh) - np.cross(upper, lower) / 2
    apart = [
        places[:, limb.lines[0][limb.start]] - places[:, limb.lines[1][limb.start]] for limb in (legs, arms)
    ]
    across = rotation.unit(apart[0])
    sine = float((across * left).sum(axis=1).mean())
    usual = across.mean(axis=0)
    first = 1 if (sine if abs(sine) > _CLEAR else usual[np.abs(usual).argmax()]) > 0 else -1
    same = float((apart[0] * apart[1]).sum(axis=1).mean()) > 0
    return (first, first if same else -first), abs(sine)
