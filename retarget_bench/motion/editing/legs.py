"""Bodies on two legs, on four, and birds: reference poses for a pair that does not stand alike.

The common reference pose has human arms out to the sides and the fore legs of an animal down. Between
bodies that stand alike poses are measured from it. From a person whose arms hang to a dog it would cross
the fore legs. It takes a bird without wings for a person, who walks upright.
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

_LEANS, _FOLDED = -0.75, 0.5
"""Cosines between trunk and legs at rest: below the first a body stands upright, above the other its bones
are laid out along one axis."""
_UNFOLDED = 0.5
"""Of the length of its bones: a leg that reaches less far at rest is folded, or its sides cancel."""


def stance(body: Character) -> Stance:
    """The kind of a body's stance. A bird has a level trunk on two legs, with wings
    (``roles.has_level_trunk``) or without."""
    if body.four_legged:
        return "four legs"
    level = PosedBody(body.skeleton, body.roles).level or _wingless(body) is not None
    return "bird" if level else "two legs"


def _wingless(body: Character) -> np.ndarray | None:
    """``(4,)`` the turn of the hips at rest that puts a bird without wings on its legs; else None."""
    posed, rest = PosedBody(body.skeleton, body.roles), body.skeleton.rest_positions
    pairs = [body.joints([f"{side}_up_leg", f"{side}_foot"]) for side in SIDES]
    lines = [rest[pair[1]] - rest[pair[0]] for pair in pairs if len(pair) == 2]
    if not lines or posed.trunk is None or posed.across is None or body.joints(["left_arm", "right_arm"]):
        return None
    legs, trunk = np.mean(lines, axis=0), posed.trunk
    if np.linalg.norm(legs) < _UNFOLDED * body.measures.leg_length:
        return None
    cosine = float(legs @ trunk) / max(float(np.linalg.norm(legs) * np.linalg.norm(trunk)), 1e-12)
    return snapped(frame(-legs, posed.across, UP, LEFT)) if _LEANS < cosine < _FOLDED else None


def alike(source: Character, target: Character) -> tuple[Character, Character]:
    """Both bodies, with the reference poses that a pair of different stances is carried over by.

    A bird without wings stands as at rest on its legs. The fore legs of a body on four legs are out to the
    sides, as arms are, where the other one has arms: arms that hang are then fore legs that stand.
    """
    bodies = [_perched(each) for each in (source, target)]
    if {stance(source), stance(target)} == {"two legs", "four legs"}:
        bodies = [_spread(each) if stance(each) == "four legs" else each for each in bodies]
    return bodies[0], bodies[1]


def _perched(body: Character) -> Character:
    """A bird without wings whose reference pose is its rest; other bodies as they are."""
    if body.four_legged or (upright := _wingless(body)) is None:
        return body
    pose = rotation.identity(len(body.skeleton))
    posed = PosedBody(body.skeleton, body.roles)
    posed.set_global(pose, posed.hips, upright)
    return _posed(body, pose)


def _posed(body: Character, pose: np.ndarray) -> Character:
    return replace(body, reference_pose=pose, measures=measure(body.skeleton, body.roles, pose))


def _spread(body: Character) -> Character:
    """A body on four legs whose reference pose has the fore legs out to the sides."""
    pose = np.array(body.reference_pose)
    posed = PosedBody(body.skeleton, body.roles)
    for side, turn in zip(SIDES, (np.pi / 2, -np.pi / 2), strict=True):
        for joint in posed.joints(f"{side}_arm"):
            out = rotation.multiply(rotation.about(FORWARD, turn), posed.get_global(pose, joint))
            posed.set_global(pose, joint, out)
    return _posed(body, pose)


def guess(source: Character, target: Character) -> str:
    """A sentence on what is a guess between two bodies that do not stand alike; "" where they do."""
    stances = (stance(source), stance(target))
    if stances[0] == stances[1]:
        return ""
    if "bird" in stances:
        bird = (source if stances[0] == "bird" else target).name
        return f"{bird} stands level on two legs, as birds do: what neck and wings should do is a guess"
    return "one body has four legs and the other two: what each limb should do is a guess"
