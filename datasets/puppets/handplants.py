"""Hands on the floor: where they rest, and how far they do."""

from __future__ import annotations

import numpy as np

from .bodies import Body
from .curves import bump, plateau, ramp
from .kneeling import all_fours, knee_ahead
from .limbs import unit
from .places import finger_tips, palm
from .score import SIDES, HandPlant, Score, sign


def weight(plant: HandPlant, frames: int) -> np.ndarray:
    """``(frames,)`` how far the hand is where it is planted: exactly 1 from ``strike`` to ``off``."""
    k = np.arange(frames, dtype=float)
    start = plant.strike - plant.coming
    if plant.going == 0:
        return ramp(k, start, plant.strike)
    return plateau(k, start, plant.strike, plant.off, plant.off + plant.going)


def rests(plant: HandPlant, frames: int) -> np.ndarray:
    """``(frames,)`` bool: the hand is on the floor."""
    k = np.arange(frames)
    return (k >= plant.strike) & (k <= plant.off)


def turned(plant: HandPlant, side: str) -> np.ndarray:
    """Orientation (3, 3) of the planted hand: palm down, or inward where it holds something."""
    yaw = plant.heading + sign(side) * plant.turned
    c, s = np.cos(yaw), np.sin(yaw)
    if plant.level > 0.0:
        back = sign(side) * np.array([c, 0.0, -s])
        fingers = unit(np.array([0.94 * s, -0.35, 0.94 * c]))
    else:
        low, far = np.sin(plant.tilt), np.cos(plant.tilt)
        back, fingers = np.array([s * low, far, c * low]), np.array([s * far, -low, c * far])
    x = sign(side) * fingers
    return np.stack([x, back, np.cross(x, back)], axis=-1)


def wrist(plant: HandPlant, side: str, body: Body) -> np.ndarray:
    """(3,) metres: the place of the planted hand's wrist. What holds something is measured there."""
    p, c, s = body.proportions, np.cos(plant.heading), np.sin(plant.heading)
    out = sign(side) * (plant.width * p.shoulder_half + plant.apart * p.arm)
    ahead = plant.ahead * p.arm
    if plant.under:
        ahead += plant.under * (p.ball + knee_ahead(body) + all_fours(body)[1])
    x, z = (p.leg * each for each in plant.place)
    place = np.array([x + out * c + ahead * s, plant.level * p.leg, z - out * s + ahead * c])
    if plant.level > 0.0:
        return place
    turn = turned(plant, side)
    # the pads of the fingers touch, or their very tips where the hand is steep
    deep = max(-(turn @ finger_tips(side, p))[1], p.hand * float(np.sin(plant.tilt)))
    across = turn @ palm(side, p)
    return place - np.array([across[0], -deep, across[2]])


def way(plant: HandPlant, side: str, body: Body, frames: int) -> np.ndarray:
    """``(frames, 3)`` metres: the wrist's place, higher while the hand is still coming."""
    k = np.arange(frames, dtype=float)
    share = (k - plant.strike + plant.coming) / max(plant.coming, 1)
    up = plant.lift * body.proportions.leg * bump(share)
    return wrist(plant, side, body) + up[:, None] * np.array([0.0, 1.0, 0.0])


def any_planted(score: Score) -> bool:
    return any(hand.plants for hand in score.hands.values())


def crouching(score: Score, short: dict[str, np.ndarray]) -> np.ndarray:
    """``(frames,)`` metres by which the hips go lower for hands that are ``short`` ``(frames,)`` of their
    places: smooth, since a hand's worst lack is spread over its coming and going."""
    total = np.zeros(score.frames)
    for side in SIDES:
        for plant in score.hands[side].plants:
            if plant.crouch:
                worst = float((short[side] * rests(plant, score.frames)).max(initial=0.0))
                total += (worst * weight(plant, score.frames)) ** 4
    return np.sqrt(np.sqrt(total))


_MOST = 0.34
"""How far hips sink for planted hands, leg lengths."""


def eased(sunk: np.ndarray | float, body: Body) -> np.ndarray:
    """How far hips sink ``(frames,)`` that ought to sink so far."""
    most = _MOST * body.proportions.leg
    return np.asarray(most * np.tanh(sunk / most))
