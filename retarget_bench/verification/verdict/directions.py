"""Limbs, feet and trunk of a result that point elsewhere than the source's, and ends that are elsewhere.

A body that was read wrongly (a back whose joints are not known, exchanged sides, feet turned round) moves
smoothly and stands on the floor; that it does not do what the source does shows here alone. Each bone may
point away by much, but not all of them to one side: head, hands and feet would be elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from retarget_bench.motion.character import Prediction
from retarget_bench.motion.roles import SIDES, bones
from retarget_bench.verification.verdict.defects import Defect, defect, stretches
from retarget_bench.verification.verdict.joints import Pair, angle_between

LASTING = 0.3
"""Seconds that a part has to point elsewhere for: held hands and feet bend limbs for a moment."""
SHORT = 1e-3
"""Body heights: a bone that is no longer has no direction."""
BONES = (
    ("trunk", "hips", "neck", 30.0),
    *(
        (f"{side} {part}", f"{side}_{begin}", f"{side}_{end}", limit)
        for side in SIDES
        for part, begin, end, limit in (
            ("upper arm", "arm", "forearm", 45.0),
            ("forearm", "forearm", "hand", 60.0),
            ("thigh", "up_leg", "leg", 55.0),
            ("shin", "leg", "foot", 55.0),
            ("foot", "foot", "toe", 60.0),
        )
    ),
)
"""Part, the roles of the joints at its ends, and degrees by which it may point away."""
ENDS = {"head": 0.4, **{f"{side}_{part}": 0.25 for side in SIDES for part in ("hand", "foot")}}
"""Role -> shares of the way along the bones from the hips by which it may be elsewhere."""


def directions(pair: Pair) -> Iterator[Defect]:
    """Stretches in which a part that both bodies have points away from the source's, or an end of theirs is
    away, by more than it is in the pose that both are compared in. Bodies on four legs are left out: their
    proportions differ too much."""
    if any(body.four_legged for body in pair.bodies):
        return
    yield from _ends(pair)
    for part, begin, end, limit in BONES:
        if not pair.has(begin, end):
            continue
        source, result = (_bone(motion, begin, end) for motion in (pair.source, pair.result))
        at_rest, away = (angle_between(one, other) for one, other in zip(source, result, strict=True))
        turned = np.where(_long(pair, source, result), away - at_rest, 0.0)
        for frames in stretches(turned > limit, pair.fps):
            if frames.stop - frames.start >= LASTING * pair.fps:
                worst = frames.start + int(np.argmax(turned[frames]))
                yield defect("turned", part, frames, worst, turned[worst], None, turned[worst] / limit)


def _ends(pair: Pair) -> Iterator[Defect]:
    for role, limit in ENDS.items():
        if not pair.has("hips", role):
            continue
        source, result = (_bone(motion, "hips", role) for motion in (pair.source, pair.result))
        ways = [bones(body.skeleton, body.joint_of[role], body.joint_of["hips"]) for body in pair.bodies]
        if not all(ways):
            continue
        both = zip(source, result, strict=True)
        at_rest, away = (np.linalg.norm(one / ways[0] - other / ways[1], axis=-1) for one, other in both)
        for frames in stretches(away - at_rest > limit, pair.fps):
            if frames.stop - frames.start >= LASTING * pair.fps:
                worst = frames.start + int(np.argmax(away[frames]))
                share = float(away[worst] - at_rest)
                part, amount = role.replace("_", " "), 100 * ways[1] * share
                yield defect("place", part, frames, worst, amount, None, share / limit)


def _bone(motion: Prediction, begin: str, end: str) -> tuple[np.ndarray, np.ndarray]:
    """``(3,)`` and ``(frames, 3)`` metres: from joint to joint, in the reference pose and in motion."""
    joints = [motion.character.joint_of[role] for role in (begin, end)]
    rest = motion.character.standing_places[joints]
    places = motion.positions[:, joints]
    return rest[1] - rest[0], places[:, 1] - places[:, 0]


def _long(pair: Pair, source: tuple[np.ndarray, ...], result: tuple[np.ndarray, ...]) -> np.ndarray:
    """``(frames,)`` bool: where the bone has a length, in both bodies, at rest and in motion."""
    longest = np.ones(pair.result.frames, dtype=bool)
    for both, body in zip((source, result), pair.bodies, strict=True):
        for bone in both:
            longest &= np.linalg.norm(bone, axis=-1) > SHORT * body.height
    return longest
