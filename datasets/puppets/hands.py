"""Arms and hands in the solver: where a hand goes, how it is turned, what collar bone and elbow do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from . import anatomy, handplants
from .bodies import Body
from .curves import smooth
from .limbs import Limb, about, apply, bend_all, cross, dot, length, part_way, rotated, unit
from .places import LOW, OF_ARM, place, resting
from .posing import Pose
from .scaling import hand_reach
from .score import SIDES, Hand, HandPlant, Score, Touch, sign

if TYPE_CHECKING:
    from .solver import Manner

Hold = tuple[np.ndarray, np.ndarray]
"""Orientations ``(frames, 3, 3)`` that a hand is turned to, and shares ``(frames,)``."""


@dataclass(frozen=True, eq=False)
class _Held:
    """A hand on its own body: from part's joint ``wrist`` (3,) metres, ``turn`` (3, 3) against that, so far
    as ``weight`` ``(frames,)`` is 1."""

    part: str
    wrist: np.ndarray
    turn: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True, eq=False)
class HandPlan:
    """What a score asks of a body's hand, whatever the passes find.

    on_chest, upright: ``(frames, 3)`` metres from the chest's joint, in its axes and in the world's: added
    up, they are where a free hand goes. floored: whether fingers are kept out of a flat floor. swivel:
    ``(frames,)`` of the elbow. wrist: ``(frames, 3, 3)`` of a free hand against its forearm. aim: what it
    is turned to, or None. touches: places on the body. plants: where the wrist goes ``(frames, 3)``, how
    far ``(frames,)``, and how the hand is turned.
    helped: ``(frames,)`` how far the hand is put on something that bending forward brings nearer.
    """

    side: str
    limb: Limb
    on_chest: np.ndarray
    upright: np.ndarray
    floored: bool
    swivel: np.ndarray
    wrist: np.ndarray
    aim: Hold | None
    touches: Sequence[_Held]
    plants: Sequence[tuple[np.ndarray, np.ndarray, Hold]]
    helped: np.ndarray


def plan(score: Score, side: str, body: Body, manner: Manner) -> HandPlan:
    hand, trunk = score.hands[side], score.trunk
    shoulder = body.reach(f"{side}_arm", body.structure.chest)
    middle = shoulder * np.array([0.0, 1.0, 1.0])
    reach = hand_reach(hand, side, body)
    upright = hand.upright[:, None]
    yaw = about(1, score.heading + trunk.pelvis[:, 0] + trunk.chest[:, 0])
    aim = None
    if hand.aim is not None:
        aim = (yaw @ _aimed(hand.aim, side), np.zeros(score.frames) + hand.aimed)
    touches = [_held(touch, side, body) for touch in hand.touches]
    low = [held.weight for held in touches if held.part in LOW]
    return HandPlan(
        side,
        anatomy.arm(side, body),
        shoulder + hand.middle[:, None] * (middle - shoulder) + (1.0 - upright) * reach,
        upright * apply(yaw, reach),
        score.stairs is None,
        sign(side) * (hand.swivel + manner.elbows),
        _wrist(hand, side),
        aim,
        touches,
        [_planted(plant, side, body, score.frames) for plant in hand.plants],
        sum(low, start=np.zeros(score.frames)),
    )


def _held(touch: Touch, side: str, body: Body) -> _Held:
    spot = place(touch.place, body)
    turn, wrist = resting(spot, side, body.proportions)
    return _Held(spot.part, wrist, turn, touch.weight)


def _planted(plant: HandPlant, side: str, body: Body, frames: int) -> tuple[np.ndarray, np.ndarray, Hold]:
    share = handplants.weight(plant, frames)
    turn = np.broadcast_to(handplants.turned(plant, side), (frames, 3, 3))
    # turned early, so that no finger is in the floor on its way down
    return handplants.way(plant, side, body, frames), share, (turn, 1.0 - (1.0 - share) ** 3)


def order(score: Score) -> Sequence[tuple[str, ...]]:
    """Which arms are set together: a hand on the other arm comes after it; where each rests there at its
    own time, one comes twice."""
    left_first, right_first = (
        any(touch.place in OF_ARM[other] for touch in score.hands[side].touches)
        for side, other in (("right", "left"), ("left", "right"))
    )
    if left_first and right_first:
        return (("right",), ("left",), ("right",))
    if left_first:
        return (("left",), ("right",))
    return (("right",), ("left",)) if right_first else (SIDES,)


def set_arms(pose: Pose, asked: Sequence[HandPlan], ease: float) -> None:
    """Collar bones, upper arms, forearms and hands. ease: how readily collar bones follow."""
    structure, limbs = pose.body.structure, tuple(each.limb for each in asked)
    chest = pose.of(structure.chest)
    goal = np.stack([_goal(pose, chest, each) for each in asked])
    for each in asked:
        pose.set(f"{each.side}_shoulder", chest)
    if structure.collars:
        start = np.stack([pose.at(f"{each.side}_arm") for each in asked])
        outward = np.array([[sign(each.side)] for each in asked])
        collar = chest @ _collar(chest, (goal - start) / limbs[0].longest, outward, ease)
        _set(pose, asked, "shoulder", collar)
    start = np.stack([pose.at(f"{each.side}_arm") for each in asked])
    _miss(pose, asked, length(goal - start) - 0.99 * limbs[0].exact * limbs[0].longest)
    upper, lower = bend_all(limbs, start, goal, chest, np.stack([each.swivel for each in asked]))
    turned = _turned(pose, asked, lower)
    # most of the hand's twist happens along the forearm
    relative = np.swapaxes(lower, -1, -2) @ turned
    twist = np.arctan2(relative[..., 2, 1] - relative[..., 1, 2], relative[..., 1, 1] + relative[..., 2, 2])
    _set(pose, asked, "arm", upper)
    _set(pose, asked, "forearm", lower @ about(0, 0.6 * twist))
    _set(pose, asked, "hand", turned)


def _set(pose: Pose, asked: Sequence[HandPlan], part: str, turned: np.ndarray) -> None:
    for each, turn in zip(asked, turned, strict=True):
        pose.set(f"{each.side}_{part}", turn)


def _miss(pose: Pose, asked: Sequence[HandPlan], far: np.ndarray) -> None:
    """Note how far ``(arms, frames)`` goals are out of reach, metres."""
    for each, by in zip(asked, far, strict=True):
        pose.short[each.side] = np.maximum(by, 0.0)
        if each.touches:
            missing = np.maximum(pose.missing, each.helped * by)
            pose.missing = np.where(each.helped > 0.0, missing, pose.missing)


def reaches_down(score: Score, body: Body) -> bool:
    """Whether a hand is put on a leg or a foot."""
    touches = [touch for hand in score.hands.values() for touch in hand.touches]
    return any(place(touch.place, body).part in LOW for touch in touches)


def _goal(pose: Pose, chest: np.ndarray, asked: HandPlan) -> np.ndarray:
    """``(frames, 3)`` metres: where the wrist goes."""
    goal = pose.at(pose.body.structure.chest) + apply(chest, asked.on_chest) + asked.upright
    if asked.floored:
        goal[:, 1] = _over_floor(goal[:, 1], pose.body)
    for held in asked.touches:
        there = pose.at(held.part) + rotated(pose.of(held.part), held.wrist)
        goal = goal + held.weight[:, None] * (there - goal)
    for way, share, _ in asked.plants:
        goal = goal + share[:, None] * (way - goal)
    return goal


def _turned(pose: Pose, asked: Sequence[HandPlan], lower: np.ndarray) -> np.ndarray:
    """Orientations ``(arms, frames, 3, 3)`` of hands on forearms that are turned so."""
    turned = lower @ np.stack([each.wrist for each in asked])
    still = (lower[0], np.zeros(lower.shape[1]))
    for holds in zip_longest(*(_holds(pose, each) for each in asked), fillvalue=still):
        turns, shares = (np.stack(each) for each in zip(*holds, strict=True))
        if shares.any():
            turned = part_way(turned, turns, shares)
    return turned


def _holds(pose: Pose, asked: HandPlan) -> list[Hold]:
    """What a hand is turned to one by one."""
    aim = [asked.aim] if asked.aim is not None else []
    touches = [(pose.of(held.part) @ held.turn, held.weight) for held in asked.touches]
    return [*aim, *touches, *(hold for _, _, hold in asked.plants)]


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


def _collar(chest: np.ndarray, line: np.ndarray, outward: np.ndarray, ease: float) -> np.ndarray:
    """Turns of collar bones ``(arms, frames, 3, 3)``: up to 20 degrees up and 15 forward, after the arm.

    line: ``(arms, frames, 3)`` from shoulder joint to wrist, arm lengths. outward: ``(arms, 1)`` signs."""
    line = apply(np.swapaxes(chest, -1, -2), line)
    up = np.radians(22.0) * ease * smooth((line[..., 1] + 0.6) / 1.8)
    ahead = np.radians(20.0) * ease * (smooth((line[..., 2] + 0.9) / 1.9) - smooth(0.9 / 1.9))
    return about(1, -outward * ahead) @ about(2, outward * up)


def _wrist(hand: Hand, side: str) -> np.ndarray:
    """A free hand's orientation against its forearm."""
    s = sign(side)
    bent, sideways, up = hand.wrist[:, 0], hand.wrist[:, 1], hand.wrist[:, 2]
    return about(0, -up) @ about(1, -s * sideways) @ about(2, -s * bent)
