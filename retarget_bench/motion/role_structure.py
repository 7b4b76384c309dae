"""Roles of joints by the tree, the symmetry of sides, lengths and places alone, where names say nothing.

The two largest pairs of like branches are the legs and the arms; the arms hang farther from the root, and
a line without a twin leads on from there to the head. A limb's bend is where its two longest bones that
follow each other meet. Knees bend backwards and feet point forwards: that tells left from right.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from itertools import combinations, pairwise

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.role_aliases import LIMBS
from retarget_bench.motion.roles import ESSENTIAL, SIDES, Roles, ancestors, common_ancestor
from retarget_bench.motion.skeleton import Skeleton

_ALIKE = 0.2
"""Share by which the bones of a pair of limbs may differ in length."""
_EVEN = 0.45
"""Least ratio of the two bones of an arm or a leg."""
_FINGERS, _COLLAR, _LAST = 0.6, 0.3, 0.3
"""What a hand that branches, a collar bone and a hand at the end count, against a length."""
_SHORT = 0.05
"""Share of the longest bone of neck and head below which another is none."""
_CLEAR = 0.1
"""Sine beyond which the left is on one side."""
_TOP_OF_HEAD = (1.2, 0.4)
"""A last bone so much longer than the neck, and than a forearm, is that from a head to its top."""

_MOST = 50
"""Branches from one joint, and pairs of them, that are compared."""

Branch = list[int]
"""Joints below each other, along the longest way."""


def completed(
    skeleton: Skeleton, roles: Sequence[str | None], places: np.ndarray, explicit: Container[str] = ()
) -> Roles:
    """Roles with a guess of those that are missing, where essential ones are and nothing contradicts it.

    places: ``(frames, joints, 3)`` of any poses. explicit: names of joints that keep what they have.
    """
    joint_of = {role: joint for joint, role in enumerate(roles) if role is not None}
    guessed = {} if joint_of.keys() >= set(ESSENTIAL) else guess(skeleton, places)
    if any(joint_of.get(role, joint) != joint for role, joint in guessed.items() if role in ESSENTIAL):
        return tuple(roles)
    out = list(roles)
    for role, joint in guessed.items():
        if role not in joint_of and out[joint] is None and skeleton.names[joint] not in explicit:
            out[joint] = role
    return tuple(out)


def guess(skeleton: Skeleton, places: np.ndarray) -> dict[str, int]:
    """Role -> joint, of the main joints of a body; empty where these are not clear.

    places: ``(frames, joints, 3)`` of any poses, which show where the left is.
    """
    pairs = _legs_and_arms(skeleton)
    if pairs is None:
        return {}
    legs, arms = pairs
    carrier = int(skeleton.parents[arms[0][0]])
    hips = common_ancestor(skeleton, [carrier, int(skeleton.parents[legs[0][0]])])
    knee, elbow = _bend(skeleton, legs[0], arm=False), _bend(skeleton, arms[0], arm=True)
    if hips is None or hips == carrier or not knee or not elbow:
        return {}
    forearm = float(skeleton.bone_lengths[arms[0][elbow + 1]])
    head = _head(skeleton, carrier, {arm[0] for arm in arms}, forearm)
    side = _first_side([places[:, [leg[j] for leg in legs]] for j in range(knee - 1, len(legs[0]))])
    apart = [
        places[:, pair[0][j - 1]] - places[:, pair[1][j - 1]] for pair, j in ((legs, knee), (arms, elbow))
    ]
    like = 1 if float((apart[0] * apart[1]).sum(axis=1).mean()) > 0 else -1
    if side == 0 or not head:
        return {}
    line = ancestors(skeleton, carrier, itself=True)
    roles = {"hips": hips, "head": head[-1]}
    roles |= _numbered("spine", line[: line.index(hips)][::-1])
    roles |= _numbered("neck", head[:-1])
    for word, leg, arm in zip(SIDES, legs[::side], arms[:: side * like], strict=True):
        limbs = (LIMBS["leg"], leg[knee - 1 :]), (LIMBS["arm"][1:], arm[elbow - 1 : elbow + 2])
        for parts, joints in (*limbs, (LIMBS["arm"], arm[max(elbow - 2, 0) : elbow - 1])):
            roles |= {f"{word}_{part}": joint for part, joint in zip(parts, joints, strict=False)}
    return roles


def _numbered(stem: str, joints: Branch) -> dict[str, int]:
    if stem == "neck" and len(joints) == 1:
        return {"neck": joints[0]}
    return {f"{stem}_{number}": joint for number, joint in enumerate(joints, 1)}


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


def _first_side(pair: Sequence[np.ndarray]) -> int:
    """1 where the first leg is the left one, -1 where it is the right one, 0 where that is not clear.

    pair: ``(frames, 2, 3)`` places of hips, knees, ankles and toes.
    """
    left = to_the_left([[joint[:, number] for joint in pair] for number in (0, 1)])
    sine = float((rotation.unit(pair[0][:, 0] - pair[0][:, 1]) * left).sum(axis=1).mean())
    return 0 if abs(sine) < _CLEAR else int(np.sign(sine))


# -------------------------------------------------------------------------------------------- the tree
def _legs_and_arms(skeleton: Skeleton) -> tuple[tuple[Branch, Branch], tuple[Branch, Branch]] | None:
    """The two largest pairs of like branches of which neither hangs from the other; None without two."""
    pairs = sorted(_pairs(skeleton, 3), key=lambda pair: -_length(skeleton, pair[0]))[:_MOST]
    for first, second in combinations(pairs, 2):
        parents = [int(skeleton.parents[pair[0][0]]) for pair in (first, second)]
        inside = {joint for pair in (first, second) for branch in pair for joint in branch}
        if parents[0] == parents[1] or inside.intersection(parents):
            continue
        depth = [len(ancestors(skeleton, joint)) for joint in parents]
        return (first, second) if depth[0] < depth[1] else (second, first)
    return None


def _pairs(skeleton: Skeleton, joints: int) -> list[tuple[Branch, Branch]]:
    """Branches of so many joints or more, from one joint, with bones of the same lengths."""
    out = []
    longest = _longest(skeleton)
    for below in skeleton.children:
        branches = [_branch(longest, child) for child in below[:_MOST]]
        for pair in combinations(branches, 2):
            if len(pair[0]) == len(pair[1]) >= joints:
                lengths = skeleton.bone_lengths[list(pair[0])], skeleton.bone_lengths[list(pair[1])]
                if np.allclose(*lengths, rtol=_ALIKE, atol=_ALIKE * max(map(np.max, lengths)) / 5):
                    out.append(pair)
    return out


def _longest(skeleton: Skeleton) -> list[int]:
    """Of every joint the child on the longest way down from it, -1 without one."""
    reach = np.zeros(len(skeleton))
    child = [-1] * len(skeleton)
    for joint in range(len(skeleton) - 1, 0, -1):
        parent, way = int(skeleton.parents[joint]), reach[joint] + skeleton.bone_lengths[joint]
        if way > reach[parent] or child[parent] < 0:
            reach[parent], child[parent] = way, joint
    return child


def _branch(longest: Sequence[int], joint: int) -> Branch:
    """A joint and those below it on the longest way."""
    branch = [joint]
    while longest[branch[-1]] >= 0:
        branch.append(longest[branch[-1]])
    return branch


def _length(skeleton: Skeleton, branch: Branch) -> float:
    return float(skeleton.bone_lengths[branch].sum())


def _bend(skeleton: Skeleton, branch: Branch, arm: bool) -> int | None:
    """Where in a limb its two long bones meet; None where there are no two.

    The bones are long and about as long; of an arm, more often than not a collar bone comes before them,
    and a hand after them, which fingers hang from.
    """
    lengths = skeleton.bone_lengths[branch]
    even = np.array([min(upper, lower) for upper, lower in pairwise(lengths[1:])])
    if not len(even) or even.max() == 0:
        return None
    score = even / even.max()
    if arm:
        score += _FINGERS * np.array([len(skeleton.children[joint]) > 1 for joint in branch[2:]])
        score[1:2] += _COLLAR
        score[-1] += _LAST
    bend = int(np.argmax(score)) + 1
    upper, lower = lengths[bend], lengths[bend + 1]
    return bend if min(upper, lower) > _EVEN * max(upper, lower) else None


def _head(skeleton: Skeleton, carrier: int, arms: set[int], forearm: float) -> Branch:
    """The line of neck and head from the arms' carrier on: joints without a twin.

    arms: the joints that these begin with. forearm: its length.
    """
    pairs = _pairs(skeleton, 1)
    twins = arms.union(branch[0] for pair in pairs for branch in pair)
    longest = _longest(skeleton)
    line, joint = [carrier], carrier
    while True:
        below = [child for child in skeleton.children[joint] if child not in twins]
        split = len(below) > 1 or len(below) < len(skeleton.children[joint])
        if not below or (joint != carrier and split):
            break
        joint = max(below, key=lambda child: _length(skeleton, _branch(longest, child)))
        line.append(joint)
    lengths = skeleton.bone_lengths[line[1:]]
    line = [each for each, length in zip(line[1:], lengths, strict=True) if length > _SHORT * lengths.max()]
    inner, last = skeleton.bone_lengths[line[1:-1]].sum(), skeleton.bone_lengths[line[-1:]].sum()
    topped = len(line) > 2 and last > max(_TOP_OF_HEAD[0] * inner, _TOP_OF_HEAD[1] * forearm)
    return line[:-1] if topped else line
