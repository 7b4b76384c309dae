"""Limbs, feet and trunk of a result that point elsewhere than the source's.

A body that was read wrongly (a back whose joints are not known, exchanged sides, feet turned round) moves
smoothly and stands on the floor; that it does not do what the source does shows here alone.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from retarget_bench.motion.character import Prediction
from retarget_bench.motion.roles import SIDES
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


def directions(pair: Pair) -> Iterator[Defect]:
    """Stretches in which a part that both bodies have points away from the source's, by more than it does
    in the pose that both are compared in. Bodies on four legs are left out: their proportions differ too
    much."""
    if any(body.four_legged for body in pair.bodies):
        return
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


def _bone(motion: Prediction, begin: str, end: str) -> tuple[np.ndarray, np.ndarray]:
    """``(3,)`` and ``(frames, 3)`` metres: from joint to joint, in the reference pose and in motion."""
    joints = [motion.character.joint_of[role] for role in (begin, end)]
    rest = motion.character.standing_places[joints]
    places = motion.positions[:, joints]
    return rest[1] - rest[0], places[:, 1] - places[:, 0]


def _long(pair: Pair, source: tuple[np.ndarray, ...], result: tuple[np.ndarray, ...]) -> np.ndarray:
    """``(frames,)`` bool: where the bone has a length, in both bodies, at rest and in motion."""
    longest = np.ones(pair.result.frames, dtype=bool)
    for bones, body in zip((source, result), pair.bodies, strict=True):
        for bone in bones:
            longest &= np.linalg.norm(bone, axis=-1) > SHORT * body.height
    return longest
