"""Feet that leave the floor for a way of their own, as in a kick: seen from the hip, not from the floor."""

from __future__ import annotations

import numpy as np

from .bodies import Body
from .curves import soft_min
from .feet import FootPath, lifted
from .limbs import about, part_way
from .scaling import air_point, air_reach
from .score import Score, sign


def ankle(score: Score, side: str, hip: np.ndarray, foot: FootPath, body: Body) -> np.ndarray:
    """``(frames, 3)`` metres: where the ankle goes; the floor's path where the foot is not aloft."""
    air = score.feet[side].air
    if air is None:
        return foot.ankle
    reach = air_reach(air, side, body)
    yaw = about(1, score.heading + score.trunk.pelvis[:, 0])
    there = hip + (yaw @ reach[..., None])[..., 0]
    goal = foot.ankle + air.weight[:, None] * (there - foot.ankle)
    return _slack(hip, goal, foot, body) if score.flights else goal


_STRETCHED = 0.972
"""Share of its length to which a leg stretches while its foot is thrown along with the body."""


def _slack(hip: np.ndarray, goal: np.ndarray, foot: FootPath, body: Body) -> np.ndarray:
    """The goal ``(frames, 3)``, drawn towards the hip where a swinging leg would have to be straight."""
    line = goal - hip
    distance = np.sqrt((line * line).sum(axis=-1))
    limb = body.proportions.thigh + body.proportions.shank
    most = np.full_like(distance, _STRETCHED * limb)
    share = np.where(foot.swinging, soft_min(distance, most, 0.02 * limb) / distance, 1.0)
    return hip + share[:, None] * line


def swivel(score: Score, side: str, grounded: np.ndarray) -> np.ndarray:
    """``(frames,)`` how the knee is turned about the line from hip to ankle."""
    air = score.feet[side].air
    if air is None:
        return grounded
    return grounded + air.weight * (sign(side) * air.swivel - grounded)


def sole(
    score: Score, side: str, shank: np.ndarray, foot: FootPath, body: Body
) -> tuple[np.ndarray, np.ndarray]:
    """Orientations ``(frames, 3, 3)`` of foot and toes: with the shin where aloft."""
    air = score.feet[side].air
    if air is None:
        return foot.sole, foot.toes
    pointed = shank @ about(0, air_point(air, body))
    # the ankle gives way early, so that it is not bent by a shin that already hangs from a raised knee
    share = 1.0 - (1.0 - air.weight) ** 2
    return part_way(foot.sole, pointed, share), part_way(foot.toes, pointed, share)


def clear(ankle: np.ndarray, sole: np.ndarray, toes: np.ndarray, foot: FootPath, body: Body) -> np.ndarray:
    """The ankle's places ``(frames, 3)``, higher where such a foot would be in the floor."""
    p = body.proportions
    ball = ankle + sole @ np.array([0.0, p.ball_height - p.ankle, p.ball])
    points = (
        ankle + sole @ np.array([0.0, -p.ankle, -p.heel]),
        ball - np.array([0.0, p.ball_height, 0.0]),
        ball + toes @ np.array([0.0, -p.ball_height, p.toes]),
    )
    up = lifted([point[:, 1] - foot.floor for point in points], 0.1 * p.ball_height)
    return ankle + up[:, None] * np.array([0.0, 1.0, 0.0])
