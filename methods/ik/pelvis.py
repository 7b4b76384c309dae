"""How far the hips have to sink so that no planted foot is out of reach."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from retarget_bench.methods.ik.ease import envelope
from retarget_bench.methods.ik.feet import Plan
from retarget_bench.methods.ik.two_bone import Limb, Pose, reach

STRAIGHT = 0.998
"""Share of a leg's length that it may span; the rest is left to the knee, which would lock otherwise."""
_DEEPEST = 0.25
"""Leg lengths: a goal that is still out of reach then is pointed at, not reached."""


def sink(pose: Pose, limbs: Sequence[Limb], plans: Sequence[Plan], fps: float) -> np.ndarray:
    """``(frames, 3)`` metres to move the body by: straight down, smooth in time, zero where all is in reach."""
    need = np.zeros(len(pose.root))
    for limb, plan in zip(limbs, plans, strict=True):
        whole = float(reach(pose, limb))
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
