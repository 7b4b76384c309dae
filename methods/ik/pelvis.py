"""Adjusting the hips so that every planted foot is in reach."""

from collections.abc import Sequence

import numpy as np

from .ease import smooth, spread
from .feet import Plan
from .two_bone import Limb, Pose, reach

STRAIGHT = 0.998
"""Share of a leg's length that it may span; the rest is left to the knee, which would lock otherwise."""
_SHARE = 0.5
"""Of what the planted feet ask for together, how much the hips take; knees and hips share it equally."""
_ROUNDS = 8
_NEAR = 1e-4
"""Metres: nearer than this to where every foot is in reach there is no need to go on."""


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
        offset[:, 1:2] = _SHARE * smooth(spread(mean[:, None], count > 0, fps), fps)
    return offset


def give(pose: Pose, limbs: Sequence[Limb], plans: Sequence[Plan], fps: float) -> np.ndarray:
    """``(frames, 3)`` metres to move the body by so that planted feet are in reach; zero where all are.

    Each planted leg allows the hips a ball around its foot. The nearest point of all balls is sought by
    projecting on one after the other; the way there is smoothed in time, and what that leaves is added,
    a few times over.
    """
    offset = np.zeros((len(pose.root), 3))
    legs = [_room(pose, limb, plan) for limb, plan in zip(limbs, plans, strict=True)]
    for _ in range(_ROUNDS):
        wanted = offset
        for to_goal, whole, firm in legs * 2:
            left = to_goal - wanted
            far = np.linalg.norm(left, axis=1)
            short = np.where(firm, np.maximum(far - whole, 0.0), 0.0)
            wanted = wanted + (short / np.maximum(far, 1e-9))[:, None] * left
        step = wanted - offset
        if np.abs(step).max() < _NEAR:
            break
        offset = offset + smooth(step, fps)
    return offset


def _room(pose: Pose, limb: Limb, plan: Plan) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """From hip joint to goal ``(frames, 3)``, how far that may be ``(frames,)``, and when it matters.

    A leg that was copied straighter than ``STRAIGHT`` may stay as straight.
    """
    hip = pose.places[:, limb.upper]
    copied = np.linalg.norm(pose.places[:, limb.end] - hip, axis=1)
    return plan.goal - hip, np.maximum(STRAIGHT * reach(pose, limb), copied), plan.firm
