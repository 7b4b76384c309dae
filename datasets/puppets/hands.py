"""Arms and hands in the solver: where a hand goes, how it is turned, what collar bone and elbow do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import anatomy, handplants
from .bodies import Body
from .curves import smooth
from .limbs import about, bend, cross, dot, part_way, unit
from .places import LOW, OF_ARM, place, resting
from .scaling import hand_reach
from .score import SIDES, Hand, Score, sign

if TYPE_CHECKING:
    from .solver import Manner, Pose

Holds = list[tuple[np.ndarray, np.ndarray]]
"""Orientations ``(frames, 3, 3)`` that a hand is turned to one by one, and shares ``(frames,)``."""


def order(score: Score) -> tuple[str, ...]:
    """A hand on the other arm comes after it; where each rests there at its own time, one comes twice."""
    left_first, right_first = (
        any(touch.place in OF_ARM[other] for touch in score.hands[side].touches)
        for side, other in (("right", "left"), ("left", "right"))
    )
    if left_first and right_first:
        return ("right", "left", "right")
    return SIDES[::-1] if right_first else SIDES


def set_arm(pose: Pose, side: str, score: Score, manner: Manner) -> None:
    """Collar bone, upper arm, forearm and hand."""
    body, hand, limb = pose.body, score.hands[side], anatomy.arm(side, pose.body)
    chest = pose.of(body.structure.chest)
    goal, holds = _goal(pose, side, score)
    pose.set(f"{side}_shoulder", chest)
    if body.structure.collars:
        pose.set(f"{side}_shoulder", chest @ _collar(pose, side, goal, limb.longest, manner.collar))
    start = pose.at(f"{side}_arm")
    far = np.sqrt(((goal - start) ** 2).sum(axis=-1)) - 0.99 * limb.exact * limb.longest
    pose.short[side] = np.maximum(far, 0.0)
    helped = _helped_by_leaning(hand, body)
    pose.missing = np.where(helped > 0.0, np.maximum(pose.missing, helped * far), pose.missing)
    swivel = sign(side) * (hand.swivel + manner.elbows)
    upper, lower = bend(limb, start, goal, chest, swivel)
    turned = lower @ _wrist(hand, side)
    for hold, share in holds:
        if np.any(share):
            turned = part_way(turned, hold, share)
    # most of the hand's twist happens along the forearm
    relative = np.swapaxes(lower, -1, -2) @ turned
    twist = np.arctan2(relative[:, 2, 1] - relative[:, 1, 2], relative[:, 1, 1] + relative[:, 2, 2])
    pose.set(f"{side}_arm", upper)
    pose.set(f"{side}_forearm", lower @ about(0, 0.6 * twist))
    pose.set(f"{side}_hand", turned)


def reaches_down(score: Score, body: Body) -> bool:
    """Whether a hand is put on a leg or a foot."""
    touches = [touch for hand in score.hands.values() for touch in hand.touches]
    return any(place(touch.place, body).part in LOW for touch in touches)


def _helped_by_leaning(hand: Hand, body: Body) -> np.ndarray:
    """``(frames,)`` how far a hand is put on something that bending forward brings nearer."""
    low = [touch.weight for touch in hand.touches if place(touch.place, body).part in LOW]
    return sum(low, start=np.zeros(len(hand.swivel)))


def _goal(pose: Pose, side: str, score: Score) -> tuple[np.ndarray, Holds]:
    """Where the wrist goes, and how the hand is turned there."""
    body, hand, trunk = pose.body, score.hands[side], score.trunk
    chest_part = body.structure.chest
    chest = pose.of(chest_part)
    shoulder = body.reach(f"{side}_arm", chest_part)
    middle = shoulder * np.array([0.0, 1.0, 1.0])
    base = shoulder + hand.middle[:, None] * (middle - shoulder)
    reach = hand_reach(hand, side, body)
    yaw = about(1, score.heading + trunk.pelvis[:, 0] + trunk.chest[:, 0])
    leaning, standing = _apply(chest, reach), _apply(yaw, reach)
    goal = pose.at(chest_part) + _apply(chest, base) + leaning
    goal = goal + hand.upright[:, None] * (standing - leaning)
    if score.stairs is None:
        goal[:, 1] = _over_floor(goal[:, 1], body)
    holds: Holds = []
    if hand.aim is not None:
        holds.append((yaw @ _aimed(hand.aim, side), np.zeros(score.frames) + hand.aimed))
    for touch in hand.touches:
        spot = place(touch.place, body)
        turn, wrist = resting(spot, side, body.proportions)
        there = pose.at(spot.part) + _apply(pose.of(spot.part), np.broadcast_to(wrist, goal.shape))
        goal = goal + touch.weight[:, None] * (there - goal)
        holds.append((pose.of(spot.part) @ turn, touch.weight))
    for plant in hand.plants:
        share = handplants.weight(plant, score.frames)
        goal = goal + share[:, None] * (handplants.way(plant, side, body, score.frames) - goal)
        # turned early, so that no finger is in the floor on its way down
        turn = np.broadcast_to(handplants.turned(plant, side), chest.shape)
        holds.append((turn, 1.0 - (1.0 - share) ** 3))
    return goal, holds


def _over_floor(height: np.ndarray, body: Body) -> np.ndarray:
    """Heights of a wrist, eased up where the fingers of a hanging hand would go through the floor."""
    least, width = 1.05 * body.proportions.hand, 0.1 * body.proportions.hand
    return 0.5 * (height + least + np.sqrt((height - least) ** 2 + width * width))


def _aimed(aim: np.ndarray, side: str) -> np.ndarray:
    """Orientations ``(frames, 3, 3)`` of a hand whose palm and fingers point where they are told."""
    out = np.array([sign(side), 1.0, 1.0])
    back = -unit(aim[:, :3] * out)
    fingers = aim[:, 3:] * out
    x = sign(side) * unit(fingers - back * dot(fingers, back))
    return np.stack([x, back, cross(x, back)], axis=-1)


def _collar(pose: Pose, side: str, goal: np.ndarray, arm: float, ease: float) -> np.ndarray:
    """Turns of a collar bone ``(frames, 3, 3)``: up to 20 degrees up and 15 forward, after the arm."""
    chest = pose.of(pose.body.structure.chest)
    line = _apply(np.swapaxes(chest, -1, -2), goal - pose.at(f"{side}_arm")) / arm
    up = np.radians(22.0) * ease * smooth((line[:, 1] + 0.6) / 1.8)
    ahead = np.radians(20.0) * ease * (smooth((line[:, 2] + 0.9) / 1.9) - smooth(0.9 / 1.9))
    return about(1, -sign(side) * ahead) @ about(2, sign(side) * up)


def _wrist(hand: Hand, side: str) -> np.ndarray:
    """A free hand's orientation against its forearm."""
    s = sign(side)
    bent, sideways, up = hand.wrist[:, 0], hand.wrist[:, 1], hand.wrist[:, 2]
    return about(0, -up) @ about(1, -s * sideways) @ about(2, -s * bent)


def _apply(turn: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Vectors ``(frames, 3)`` turned by matrices ``(frames, 3, 3)``."""
    return (turn @ v[..., None])[..., 0]
