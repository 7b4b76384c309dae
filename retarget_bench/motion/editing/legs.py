"""Bodies on two legs, on four, and birds: reference poses for a pair that does not stand alike.

The common reference pose has human arms out to the sides, the fore legs of an animal down, and every trunk
on two legs upright. Between bodies that stand alike poses are measured from it. From a person whose arms
hang to a dog it would cross the fore legs, and a bird would walk upright.
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.body import FORWARD, LEFT, UP, PosedBody, frame, snapped
from retarget_bench.motion.character import Character
from retarget_bench.motion.measures import measure
from retarget_bench.motion.roles import SIDES

Stance = Literal["two legs", "four legs", "bird"]

_LEANS, _SEATED, _FOLDED = -0.75, -0.5, 0.5
"""Cosines between trunk and legs at rest: below the first a body stands upright, or one with arms below the
second; above the third its bones are laid out along one axis (as ``roles.stands_on_four`` has it)."""
_UNFOLDED = 0.5
"""Of the length of its bones: a leg that reaches less far at rest is folded, or its sides cancel."""
_UPRIGHT = np.radians(5.0)
"""From there on hips of a bird do not stand by its legs."""
_REACH = 0.5
"""Of the way from hips to feet: fore limbs that reach farther down are legs, others wings."""


def stance(body: Character) -> Stance:
    """How a body stands. A bird has a level trunk on two legs, whatever its fore limbs are."""
    if body.four_legged:
        places = body.reference_places
        hips, hands, feet = (
            places[body.joints(roles), 1]
            for roles in (["hips"], ["left_hand", "right_hand"], ["left_foot", "right_foot"])
        )
        wings = hands.size and hips[0] - hands.mean() < _REACH * (hips[0] - feet.mean())
        return "bird" if wings or not hands.size else "four legs"
    return "bird" if _level_trunk(body) else "two legs"


def _level_trunk(body: Character) -> bool:
    """Whether a body on two legs has a trunk across its legs at rest. People may rest seated, so one with
    arms, or wings, has to be clearly so."""
    seen, legs = PosedBody(body.skeleton, body.roles), _legs(body)
    if legs is None or seen.across is None or np.linalg.norm(legs) < _UNFOLDED * body.measures.leg_length:
        return False
    arms, rest = body.joints(["left_arm", "right_arm"]), body.skeleton.rest_positions
    trunk = rest[arms or [seen.trunk_end]].mean(axis=0) - rest[seen.hips]
    cosine = float(legs @ trunk) / max(float(np.linalg.norm(legs) * np.linalg.norm(trunk)), 1e-12)
    return bool(trunk.any()) and (_SEATED if arms else _LEANS) < cosine < _FOLDED


def _legs(body: Character) -> np.ndarray | None:
    """``(3,)`` metres: the mean line from the upper legs to the feet at rest."""
    rest, pairs = body.skeleton.rest_positions, []
    for side in SIDES:
        pair = body.joints([f"{side}_up_leg", f"{side}_foot"])
        if len(pair) == 2:
            pairs.append(rest[pair[1]] - rest[pair[0]])
    return np.mean(pairs, axis=0) if pairs else None


def alike(source: Character, target: Character) -> tuple[Character, Character]:
    """Both bodies, with the reference poses that a pair of different stances is carried over by.

    A bird stands as at rest on its legs. The fore legs of a body on four legs are out to the sides, as arms
    are, where the other one has arms: arms that hang are then fore legs that stand.
    """
    bodies = [_perched(each) if stance(each) == "bird" else each for each in (source, target)]
    if {stance(source), stance(target)} == {"two legs", "four legs"}:
        bodies = [_spread(each) if stance(each) == "four legs" else each for each in bodies]
    return bodies[0], bodies[1]


def _perched(body: Character) -> Character:
    """A bird whose reference pose is its rest, upright by its legs and not by where the trunk points; the
    body itself where its hips stand so already."""
    seen, legs = PosedBody(body.skeleton, body.roles), _legs(body)
    if legs is None or seen.across is None:
        return body
    upright = snapped(frame(-legs, seen.across, UP, LEFT))
    if rotation.angle(body.reference_globals[seen.hips], upright) < _UPRIGHT:
        return body
    pose = rotation.identity(len(body.skeleton))
    seen.set_global(pose, seen.hips, upright)
    return _posed(body, pose)


def _spread(body: Character) -> Character:
    """A body on four legs whose reference pose has the fore legs out to the sides."""
    pose = np.array(body.reference_pose)
    seen = PosedBody(body.skeleton, body.roles)
    for side, turn in zip(SIDES, (np.pi / 2, -np.pi / 2), strict=True):
        for joint in seen.joints(f"{side}_arm"):
            out = rotation.multiply(rotation.about(FORWARD, turn), seen.get_global(pose, joint))
            seen.set_global(pose, joint, out)
    return _posed(body, pose)


def _posed(body: Character, pose: np.ndarray) -> Character:
    return replace(body, reference_pose=pose, measures=measure(body.skeleton, body.roles, pose))


def guess(source: Character, target: Character) -> str:
    """A sentence on what is a guess between two bodies that do not stand alike; "" where they do."""
    stances = (stance(source), stance(target))
    if stances[0] == stances[1]:
        return ""
    if "bird" in stances:
        bird = (source if stances[0] == "bird" else target).name
        return f"{bird} stands level on two legs, as birds do: what neck and wings should do is a guess"
    return "one body has four legs and the other two: what each limb should do is a guess"
