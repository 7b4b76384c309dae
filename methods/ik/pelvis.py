"""How the hips give way to the feet: by what both ask for, and until every planted foot is in reach."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .ease import envelope, smooth, spread
from .feet import Plan
from .two_bone import Limb, Pose, reach

STRAIGHT = 0.998
"""Share of a leg's length that it may span; the rest is left to the knee, which would lock otherwise."""
_SHARE = 0.5
"""Of what the planted feet ask for together, how much the hips take; knees and hips share it equally."""
_DEEPEST = 0.25
"""Leg lengths: a goal that is still out of reach then is pointed at, not reached."""


def settle(pose: Pose, limbs: Sequence[Limb], plans: Sequence[Plan], fps: float) -> np.ndarray:
    """``(frames, 3)`` metres to move the body by, up or down, so that copied legs stand on the floor.

    Legs of other proportions, or bent at rest, stand higher or lower in the same pose. The hips take what
    the planted feet have in common; the rest is left to the knees.
    """
    firm = np.stack([plan.firm for plan in plans], axis=1)
    lift = np.stack(
        [plan.goal[:, 1] - pose.places[:, limb.end, 1] for limb, plan in zip(limbs, plans, strict=True)],
        axis=1,
    )
    count = firm.sum(axis=1)
    mean = (lift * firm).sum(axis=1) / np.maximum(count, 1)
    offset = np.zeros((len(mean), 3))
    if count.any():
        offset[:, 1] = _SHARE * smooth(spread(mean[:, None], count > 0, fps)[:, 0], fps)
    return offset


def sink(pose: Pose, limbs: Sequence[Limb], plans: Sequence[Plan], fps: float) -> np.ndarray:
    """``(frames, 3)`` metres to move the body by: down, smooth in time, zero where all is in reach."""
    need = np.zeros(len(pose.root))
    for limb, plan in zip(limbs, plans, strict=True):
        whole = reach(pose, limb)
        to_goal = plan.goal - pose.places[:, limb.upper]
        level = to_goal[:, 0] ** 2 + to_goal[:, 2] ** 2
        # standing over the foot at this horizontal distance, a straight leg spans so much height
        span = np.sqrt(np.maximum((STRAIGHT * whole) ** 2 - level, 0.0))
        drop = np.clip(-to_goal[:, 1] - span, 0.0, _DEEPEST * whole)
        need = np.maximum(need, np.where(plan.firm, drop, 0.0))
    offset = np.zeros((len(need), 3))
    if need.any():
        offset[:, 1] = -envelope(need, fps)
    return offset
