"""Frames to look at in a retargeted motion, found beside its source: no reference is needed.

``verdict`` compares a result with its source and lists frames, each with its reason:

- ``snap``: a knee or elbow turns much faster than the source's;
- ``straight``: a knee or elbow is stretched where the source's is bent;
- ``speed``: a joint moves much faster than the source's would on this body;
- ``floor``: a foot is below the floor that the source stands on;
- ``slide``: a foot slides while the source's stands;
- ``turned``: a limb, a foot or the trunk points elsewhere than the source's;
- ``place``: head, a hand or a foot is elsewhere, seen from the hips, than the source's;
- ``inside``: a hand is in the body, where the result's character has a mesh.

There is no all-clear where limbs are a guess, or where a motion was read wrongly (``doubts.py``).

Bones that nothing drives (capes, hair, props, twist joints) follow their parent; they are named, and are no
errors. The limits stand at the top of ``joints.py`` and ``penetration.py``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Character, Prediction
from retarget_bench.motion.editing import twists
from retarget_bench.motion.roles import explain
from retarget_bench.motion.transfer import FOLLOW, correspondence, reason
from retarget_bench.verification.verdict.defects import Defect, Verdict
from retarget_bench.verification.verdict.directions import directions
from retarget_bench.verification.verdict.doubts import doubts
from retarget_bench.verification.verdict.joints import Pair, bends, feet, speeds
from retarget_bench.verification.verdict.penetration import hands

__all__ = ["Defect", "Verdict", "verdict"]

SAME_RATE = 1e-3
"""Share by which two rates may differ and still count as one: frame times in files are rounded."""
_FIRST = {kind: rank for rank, kind in enumerate(("extra", "not understood", "helper", "above the hips"))}
"""Why a joint has no role (``roles.explain``) -> its place in lists."""
CAUSED = {
    "snap": ("speed", "slide"),
    "speed": ("slide",),
    "straight": ("place",),
    "turned": ("place",),
}
"""Kind -> kinds that follow from it in the same frames, and are not told again."""


def verdict(source: Prediction, result: Prediction) -> Verdict:
    """The defects of a result beside its source; each cause is reported once.

    source, result: motions with as many frames at one rate, of two bodies or one.
    Hands are looked at where the result is known by rotations and its character has a mesh.
    Raises BenchError where frames or rates differ, or the bodies share no roles.
    """
    if why := reason(source.character, result.character):
        raise BenchError(f"there is no verdict: {why}")
    differs = abs(source.fps - result.fps) > SAME_RATE * result.fps
    if differs or source.frames != result.frames:
        raise BenchError(
            f"a verdict compares frame by frame: the source has {source.frames} frames at {source.fps:g} "
            f"per second, the result {result.frames} at {result.fps:g}; resample or cut one of them"
        )
    pair = Pair(source, result)
    defects = [*bends(pair), *speeds(pair), *feet(pair), *directions(pair), *hands(pair)]
    causes = [each for each in defects if not _caused(each, defects)]
    worst_first = tuple(sorted(causes, key=lambda each: -each.severity))
    left = undriven(source.character, result.character)
    doubtful = tuple(dict.fromkeys(doubts(source, result)))
    return Verdict(result.frames, result.fps, worst_first, left, doubtful)


def undriven(source: Character, target: Character) -> tuple[str, ...]:
    """The target's joints that nothing of the source corresponds to, but for its root and for twist bones,
    which take their share of a limb's: first capes, hair and props, then what else has no role, then others
    such as fingers."""
    left = np.flatnonzero((correspondence(source, target) == FOLLOW) & (target.skeleton.parents >= 0))
    left = np.setdiff1d(left, [each.joint for each in twists.find(target)])
    meaning = explain(target.skeleton, target.roles)
    ordered = sorted(left.tolist(), key=lambda joint: _FIRST.get(meaning[joint], len(_FIRST)))
    return tuple(target.skeleton.names[joint] for joint in ordered)


def _caused(defect: Defect, others: Sequence[Defect]) -> bool:
    """Whether another defect in the same frames explains this one."""
    return any(
        defect.kind in CAUSED.get(other.kind, ())
        and other.first <= defect.last
        and defect.first <= other.last
        for other in others
    )
