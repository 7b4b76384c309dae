"""Legs in the solver: both at once, from the hip joints to the paths of the feet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from . import aloft, anatomy, kneeling
from .feet import FootPath
from .limbs import bend_all
from .posing import Pose
from .score import SIDES, Score


@dataclass(frozen=True, eq=False)
class LegPlan:
    """What a score asks of a body's legs, whatever the passes find.

    swivel: ``(2, frames)`` of the knees. pole: where knees rest ``(2, frames, 3)`` and how far they do
    ``(2, frames)``, or None.
    """

    feet: Mapping[str, FootPath]
    swivel: np.ndarray
    pole: tuple[np.ndarray, np.ndarray] | None


def plan(score: Score, feet: Mapping[str, FootPath], knees: float, resting: np.ndarray | None) -> LegPlan:
    """knees: share of a foot's turn that the knee follows. resting: ``(2, frames, 3)`` places of knees."""
    facing = score.heading + score.trunk.pelvis[:, 0]
    swivel = np.stack([aloft.swivel(score, side, knees * (facing - feet[side].yaw)) for side in SIDES])
    pole = None
    pole = None
    if resting is not None:
        # a foot that is carried somewhere has its own way of turning the knee
        grounded = [score.feet[side].air is None for side in SIDES]
        kneels = [kneeling.kneels(score, side) * own for side, own in zip(SIDES, grounded, strict=True)]
        pole = (resting, np.stack(kneels))
    return LegPlan(feet, swivel, pole)


def set_legs(pose: Pose, score: Score, asked: LegPlan) -> None:
    """Thighs, shanks, feet and toes."""
    body, hips, hip = pose.body, pose.of("hips"), pose.both("up_leg")
    limbs, feet = (anatomy.leg(body),) * 2, asked.feet
    goal = np.stack(
        [aloft.ankle(score, side, at, feet[side], body) for side, at in zip(SIDES, hip, strict=True)]
    )
    thigh, shank = bend_all(limbs, hip, goal, hips, asked.swivel, asked.pole)
    carried = [(k, side) for k, side in enumerate(SIDES) if score.feet[side].air is not None]
    for _ in range(2 if carried else 0):
        for k, side in carried:
            soles = aloft.sole(score, side, shank[k], feet[side], body)
            goal[k] = aloft.clear(goal[k], *soles, feet[side], body)
        thigh, shank = bend_all(limbs, hip, goal, hips, asked.swivel, asked.pole)
    pose.set_both("up_leg", thigh)
    pose.set_both("leg", shank)
    for side, turn in zip(SIDES, shank, strict=True):
        sole, toes = aloft.sole(score, side, turn, feet[side], body)
        pose.set(f"{side}_foot", sole)
        pose.set(f"{side}_toe", toes)
