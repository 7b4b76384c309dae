"""Feet below the floor that the source stands on, and feet that slide while the source's stand."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from retarget_bench.motion import contact, rotation
from retarget_bench.motion.body import UP
from retarget_bench.motion.character import Motion, Prediction
from retarget_bench.motion.planting.feet import planted
from retarget_bench.motion.roles import SIDES
from retarget_bench.verification.verdict.defects import Defect, stretches
from retarget_bench.verification.verdict.pair import Pair

DEEP = 0.02
"""Body heights that a foot may be deeper than the source's at this size."""
LASTING = 0.1
"""Seconds that a foot has to be in the floor for."""
SLID = 0.025
"""Body heights that a foot may slide beyond ``FARTHER`` times what the source's does at this size."""
FARTHER = 1.5
_STEP = 0.06
"""Body heights above the lowest floor from where a standing foot is on a step."""
_EDGE = 1 / 30
"""Seconds at either end of a stand, in which a foot may already or still move."""


def feet(pair: Pair) -> Iterator[Defect]:
    """Defects of the feet that both bodies have."""
    for side in SIDES:
        joints = [role for part in ("toe", "foot") if pair.has(role := f"{side}_{part}")]
        if joints:
            stands = planted(pair.source, pair.source.character.joint_of[joints[0]])  # type: ignore[arg-type]
            yield from _through_floor(pair, side, stands)
            yield from _slides(pair, side, joints[0], stands)


def _through_floor(pair: Pair, side: str, stands: np.ndarray) -> Iterator[Defect]:
    height = pair.result.character.height
    seen, found = (_lowest(motion, side) for motion in (pair.source, pair.result))
    level = float(np.quantile(seen[stands], 0.05)) if stands.any() else 0.0
    on_step = stands & (seen > level + _STEP * pair.source.character.height)
    floor = pair.ratio * np.where(on_step, seen, min(level, 0.0))
    theirs = pair.ratio * np.maximum(np.where(on_step, 0.0, level - seen), 0.0)
    deep = floor - found
    passing = theirs + DEEP * height
    for part in stretches(deep > passing, pair.fps):
        if part.stop - part.start < LASTING * pair.fps:
            continue
        worst = part.start + int(np.argmax((deep - theirs)[part]))
        amount, source = 100 * float(deep[worst]), 100 * float(theirs[worst])
        yield Defect(
            "floor",
            f"{side} foot",
            part.start,
            part.stop - 1,
            worst,
            amount,
            source,
            "cm",
            float(deep[worst] / passing[worst]),
            f"{side} foot goes through the floor ({amount:.0f} cm; source {source:.0f})",
        )


def _lowest(motion: Prediction, side: str) -> np.ndarray:
    """``(frames,)`` metres: the lowest of the soles under ankle and toes, and of these joints themselves,
    above the floor y = 0.

    Soles are as far below the joints as in the reference pose, and turn with them: a kneeling foot that
    lies on its instep is not in the floor. Without rotations a sole is taken to be below its joint.
    """
    body = motion.character
    joints = body.joints([f"{side}_{part}" for part in ("foot", "toe", "toe_end")])
    places, thick = motion.positions[:, joints, 1], body.standing_places[joints, 1]
    if not isinstance(motion, Motion):
        return np.asarray((places - thick).min(axis=1))
    back = rotation.conjugate(body.reference_globals[joints])
    down = rotation.multiply(motion.global_rotations[:, joints], back[None])
    soles = places - thick * rotation.rotate(down, UP)[..., 1]
    return np.asarray(np.minimum(places, soles).min(axis=1))


def _slides(pair: Pair, side: str, role: str, stands: np.ndarray) -> Iterator[Defect]:
    edge = round(_EDGE * pair.fps)
    theirs, ours = pair.paths(role)
    for start, past in contact.runs(stands).tolist():
        first, last = start + (edge if start else 0), past - 1 - (edge if past < len(stands) else 0)
        if last - first < 1:
            continue
        source = pair.ratio * _extent(theirs[first : last + 1])
        amount = _extent(ours[first : last + 1])
        passing = FARTHER * source + SLID * pair.result.character.height
        if amount > passing:
            away = np.linalg.norm(ours[first : last + 1] - ours[first : last + 1].mean(axis=0), axis=1)
            yield Defect(
                "slide",
                f"{side} foot",
                first,
                last,
                first + int(np.argmax(away)),
                100 * amount,
                100 * source,
                "cm",
                amount / passing,
                f"{side} foot slides ({100 * amount:.0f} cm; source {100 * source:.0f})",
            )


def _extent(path: np.ndarray) -> float:
    """Metres along the ground between the farthest places of a path ``(frames, 3)``, by its box."""
    return float(np.linalg.norm(np.ptp(path[:, [0, 2]], axis=0)))
