"""Arms and hands: where a hand goes, and how collar bone and elbow follow."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from ..bodies.structures import Body
from ..conventions import SIDES, sign
from ..curves import bump, plateau, ramp, smooth
from ..matrices import about, apply, cross, dot, length, part_way, rotated, unit
from ..performances.score import Hand, HandPlant, Score, Touch
from .kneeling import all_fours, knee_ahead
from .limbs import Limb, arm_limb, bend_all
from .pose import Pose
from .scaling import hand_reach
from .touch_points import LOW, OF_ARM, finger_tips, palm, resting, touch_point


def plant_weight(plant: HandPlant, frames: int) -> np.ndarray:
    """``(frames,)`` how far the hand is where it is planted: exactly 1 from ``strike`` to ``off``."""
    k = np.arange(frames, dtype=float)
    start = plant.strike - plant.coming
    if plant.going == 0:
        return ramp(k, start, plant.strike)
    return plateau(k, start, plant.strike, plant.off, plant.off + plant.going)


def plant_rests(plant: HandPlant, frames: int) -> np.ndarray:
    """``(frames,)`` bool: the hand is on the floor."""
    k = np.arange(frames)
    return (k >= plant.strike) & (k <= plant.off)


def plant_rotation(plant: HandPlant, side: str) -> np.ndarray:
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


def plant_wrist(plant: HandPlant, side: str, body: Body) -> np.ndarray:
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
    turn = plant_rotation(plant, side)
    # the pads of the fingers touch, or their very tips where the hand is steep
    deep = max(-(turn @ finger_tips(side, p))[1], p.hand * float(np.sin(plant.tilt)))
    across = turn @ palm(side, p)
    return place - np.array([across[0], -deep, across[2]])


def plant_path(plant: HandPlant, side: str, body: Body, frames: int) -> np.ndarray:
    """``(frames, 3)`` metres: the wrist's place, higher while the hand is still coming."""
    k = np.arange(frames, dtype=float)
    share = (k - plant.strike + plant.coming) / max(plant.coming, 1)
    up = plant.lift * body.proportions.leg * bump(share)
    return plant_wrist(plant, side, body) + up[:, None] * np.array([0.0, 1.0, 0.0])


def any_planted(score: Score) -> bool:
    return any(hand.plants for hand in score.hands.values())


def crouching(score: Score, short: dict[str, np.ndarray]) -> np.ndarray:
    """``(frames,)`` metres by which the hips go lower for hands that are ``short`` ``(frames,)`` of their
    places: smooth, since a hand's worst lack is spread over its coming and going."""
    total = np.zeros(score.frames)
    for side in SIDES:
        for plant in score.hands[side].plants:
            if plant.crouch:
                worst = float((short[side] * plant_rests(plant, score.frames)).max(initial=0.0))
                total += (worst * plant_weight(plant, score.frames)) ** 4
    return np.sqrt(np.sqrt(total))


_MOST = 0.34
"""How far hips sink for planted hands, leg lengths."""


def eased_crouch(sunk: np.ndarray | float, body: Body) -> np.ndarray:
    """How far hips sink ``(frames,)`` that ought to sink so far."""
    most = _MOST * body.proportions.leg
    return np.asarray(most * np.tanh(sunk / most))


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
    """The demands of a score on a hand, computed once for all passes.

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


def plan(score: Score, side: str, body: Body, elbows: float) -> HandPlan:
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
        arm_limb(side, body),
        shoulder + hand.middle[:, None] * (middle - shoulder) + (1.0 - upright) * reach,
        upright * apply(yaw, reach),
        score.stairs is None,
        sign(side) * (hand.swivel + elbows),
        _wrist(hand, side),
        aim,
        touches,
        [_planted(plant, side, body, score.frames) for plant in hand.plants],
        sum(low, start=np.zeros(score.frames)),
    )


def _held(touch: Touch, side: str, body: Body) -> _Held:
    spot = touch_point(touch.place, body)
    turn, wrist = resting(spot, side, body.proportions)
    return _Held(spot.part, wrist, turn, touch.weight)


def _planted(plant: HandPlant, side: str, body: Body, frames: int) -> tuple[np.ndarray, np.ndarray, Hold]:
    share = plant_weight(plant, frames)
    turn = np.broadcast_to(plant_rotation(plant, side), (frames, 3, 3))
    # turned early, so that no finger is in the floor on its way down
    return plant_path(plant, side, body, frames), share, (turn, 1.0 - (1.0 - share) ** 3)


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
    oriented = _oriented(pose, asked, lower)
    # most of the hand's twist happens along the forearm
    relative = np.swapaxes(lower, -1, -2) @ oriented
    twist = np.arctan2(relative[..., 2, 1] - relative[..., 1, 2], relative[..., 1, 1] + relative[..., 2, 2])
    _set(pose, asked, "arm", upper)
    _set(pose, asked, "forearm", lower @ about(0, 0.6 * twist))
    _set(pose, asked, "hand", oriented)


def _set(pose: Pose, asked: Sequence[HandPlan], part: str, oriented: np.ndarray) -> None:
    for each, turn in zip(asked, oriented, strict=True):
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
    return any(touch_point(touch.place, body).part in LOW for touch in touches)


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


def _oriented(pose: Pose, asked: Sequence[HandPlan], lower: np.ndarray) -> np.ndarray:
    """Orientations ``(arms, frames, 3, 3)`` of hands on forearms that are turned so."""
    oriented = lower @ np.stack([each.wrist for each in asked])
    still = (lower[0], np.zeros(lower.shape[1]))
    for holds in zip_longest(*(_holds(pose, each) for each in asked), fillvalue=still):
        turns, shares = (np.stack(each) for each in zip(*holds, strict=True))
        if shares.any():
            oriented = part_way(oriented, turns, shares)
    return oriented


def _holds(pose: Pose, asked: HandPlan) -> list[Hold]:
    """Orientations that a hand is turned to, one after the other."""
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
