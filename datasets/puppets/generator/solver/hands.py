"""Arms and hands: where a hand goes, and how collar bone and elbow follow."""

from collections.abc import Iterable, Sequence
from itertools import zip_longest

import numpy as np

from ..bodies.structures import Body
from ..conventions import SIDES, sign
from ..curves import bump, plateau, ramp, smooth
from ..matrices import about, cross, dot, length, part_way, rotated, unit
from ..performances.score import HandContact, Score
from .kneeling import all_fours, knee_ahead
from .limbs import arm_limb, bend
from .pose import Pose
from .scaling import hand_reach
from .touch_points import LOW, OF_ARM, finger_tips, palm, resting, touch_point


def contact_weight(contact: HandContact, frames: int) -> np.ndarray:
    """``(frames,)`` how far the hand is where it is planted: exactly 1 from ``strike`` to ``off``."""
    k = np.arange(frames, dtype=float)
    start = contact.strike - contact.coming
    if contact.leaving == 0:
        return ramp(k, start, contact.strike)
    return plateau(k, start, contact.strike, contact.off, contact.off + contact.leaving)


def contact_rests(contact: HandContact, frames: int) -> np.ndarray:
    """``(frames,)`` bool: the hand is on the floor."""
    k = np.arange(frames)
    return (k >= contact.strike) & (k <= contact.off)


def contact_rotation(contact: HandContact, side: str) -> np.ndarray:
    """Orientation (3, 3) of the planted hand: palm down, or inward where it holds something."""
    yaw = contact.heading + sign(side) * contact.turned
    c, s = np.cos(yaw), np.sin(yaw)
    if contact.level > 0.0:
        back = sign(side) * np.array([c, 0.0, -s])
        fingers = unit(np.array([0.94 * s, -0.35, 0.94 * c]))
    else:
        low, far = np.sin(contact.tilt), np.cos(contact.tilt)
        back, fingers = np.array([s * low, far, c * low]), np.array([s * far, -low, c * far])
    x = sign(side) * fingers
    return np.stack([x, back, np.cross(x, back)], axis=-1)


def contact_wrist(contact: HandContact, side: str, body: Body) -> np.ndarray:
    """(3,) metres: the place of the planted hand's wrist. What holds something is measured there."""
    p, c, s = body.proportions, np.cos(contact.heading), np.sin(contact.heading)
    out = sign(side) * (contact.width * p.shoulder_half + contact.apart * p.arm)
    ahead = contact.ahead * p.arm
    if contact.under:
        ahead += contact.under * (p.ball + knee_ahead(body) + all_fours(body)[1])
    x, z = (p.leg * each for each in contact.place)
    place = np.array([x + out * c + ahead * s, contact.level * p.leg, z - out * s + ahead * c])
    if contact.level > 0.0:
        return place
    turn = contact_rotation(contact, side)
    # the pads of the fingers touch, or their very tips where the hand is steep
    deep = max(-(turn @ finger_tips(side, p))[1], p.hand * float(np.sin(contact.tilt)))
    across = turn @ palm(side, p)
    return place - np.array([across[0], -deep, across[2]])


def contact_path(contact: HandContact, side: str, body: Body, frames: int) -> np.ndarray:
    """``(frames, 3)`` metres: the wrist's place, higher while the hand is still coming."""
    k = np.arange(frames, dtype=float)
    share = (k - contact.strike + contact.coming) / max(contact.coming, 1)
    up = contact.lift * body.proportions.leg * bump(share)
    return contact_wrist(contact, side, body) + up[:, None] * np.array([0.0, 1.0, 0.0])


def crouching(score: Score, short: dict[str, np.ndarray]) -> np.ndarray:
    """``(frames,)`` metres by which the hips go lower for hands that are ``short`` ``(frames,)`` of their
    places: smooth, since a hand's worst lack is spread over its coming and going."""
    total = np.zeros(score.frames)
    for side in SIDES:
        for contact in score.hands[side].contacts:
            if contact.crouch:
                worst = float((short[side] * contact_rests(contact, score.frames)).max(initial=0.0))
                total += (worst * contact_weight(contact, score.frames)) ** 4
    return np.sqrt(np.sqrt(total))


Hold = tuple[np.ndarray, np.ndarray]
"""Orientations ``(frames, 3, 3)`` that a hand is turned to, and shares ``(frames,)``."""


class Arm:
    """The demands of a score on one arm, computed once for all passes."""

    def __init__(self, score: Score, side: str, body: Body, elbows: float) -> None:
        hand, trunk, frames = score.hands[side], score.trunk, score.frames
        self.side, self.limb = side, arm_limb(side, body, score.slack)
        # (frames, 3) metres from the chest's joint, in its axes and in the world's: added up, they are
        # where a free hand goes
        shoulder = body.reach(f"{side}_arm", body.structure.chest)
        middle = shoulder * np.array([0.0, 1.0, 1.0])
        reach, upright = hand_reach(hand, side, body), hand.upright[:, None]
        yaw = about(1, score.heading + trunk.pelvis[:, 0] + trunk.chest[:, 0])
        self.on_chest = shoulder + hand.middle[:, None] * (middle - shoulder) + (1.0 - upright) * reach
        self.upright = upright * rotated(yaw, reach)
        # fingers are kept out of a flat floor
        self.floored = score.stairs is None
        # (frames,) of the elbow, and a free hand's orientations (frames, 3, 3) against its forearm
        self.swivel, s = sign(side) * (hand.swivel + elbows), sign(side)
        bent, sideways, up = hand.wrist.T
        self.wrist = about(0, -up) @ about(1, -s * sideways) @ about(2, -s * bent)
        self.aim: list[Hold] = []
        if hand.aim is not None:
            self.aim = [(yaw @ _aimed(hand.aim, side), np.zeros(frames) + hand.aimed)]
        # places on the body: part, orientation (3, 3) and wrist (3,) in its axes, how far (frames,)
        spots = [(touch_point(touch.place, body), touch.weight) for touch in hand.touches]
        self.touches = [(spot.part, *resting(spot, side, body.proportions), far) for spot, far in spots]
        # how far (frames,) the hand is put on something that bending forward brings nearer
        low = [far for spot, far in spots if spot.part in LOW]
        self.helped = sum(low, start=np.zeros(frames))
        # places on the floor: the wrist (frames, 3), how far (frames,), and how the hand is turned: early,
        # so that no finger is in the floor on its way down
        self.contacts: list[tuple[np.ndarray, np.ndarray, Hold]] = []
        for contact in hand.contacts:
            far = contact_weight(contact, frames)
            turn = np.broadcast_to(contact_rotation(contact, side), (frames, 3, 3))
            self.contacts.append(
                (contact_path(contact, side, body, frames), far, (turn, 1.0 - (1.0 - far) ** 3))
            )


def order(score: Score) -> Sequence[tuple[str, ...]]:
    """The order of setting arms: a hand on the other arm comes after it; where each rests there at its
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


def set_arms(pose: Pose, arms: Sequence[Arm], ease: float) -> None:
    """Collar bones, upper arms, forearms and hands. ease: how readily collar bones follow."""
    structure, limbs = pose.body.structure, tuple(arm.limb for arm in arms)
    chest = pose.of(structure.chest)
    goal = np.stack([_goal(pose, chest, arm) for arm in arms])
    _set(pose, arms, "shoulder", [chest] * len(arms))
    start = np.stack([pose.at(f"{arm.side}_arm") for arm in arms])
    if structure.collars:
        outward = np.array([[sign(arm.side)] for arm in arms])
        collar = chest @ _collar(chest, (goal - start) / limbs[0].longest, outward, ease)
        _set(pose, arms, "shoulder", collar)
        start = np.stack([pose.at(f"{arm.side}_arm") for arm in arms])
    far = length(goal - start) - 0.99 * limbs[0].exact * limbs[0].longest
    for arm, by in zip(arms, far, strict=True):
        pose.short[arm.side] = np.maximum(by, 0.0)
        if arm.touches:
            missing = np.maximum(pose.missing, arm.helped * by)
            pose.missing = np.where(arm.helped > 0.0, missing, pose.missing)
    upper, lower = bend(limbs, start, goal, chest, np.stack([arm.swivel for arm in arms]))
    oriented = _oriented(pose, arms, lower)
    # most of the hand's twist happens along the forearm
    relative = np.swapaxes(lower, -1, -2) @ oriented
    twist = np.arctan2(relative[..., 2, 1] - relative[..., 1, 2], relative[..., 1, 1] + relative[..., 2, 2])
    _set(pose, arms, "arm", upper)
    _set(pose, arms, "forearm", lower @ about(0, 0.6 * twist))
    _set(pose, arms, "hand", oriented)


def _set(pose: Pose, arms: Sequence[Arm], part: str, oriented: Iterable[np.ndarray]) -> None:
    for arm, turn in zip(arms, oriented, strict=True):
        pose.set(f"{arm.side}_{part}", turn)


def _goal(pose: Pose, chest: np.ndarray, arm: Arm) -> np.ndarray:
    """``(frames, 3)`` metres: where the wrist goes."""
    goal = pose.at(pose.body.structure.chest) + rotated(chest, arm.on_chest) + arm.upright
    if arm.floored:
        # eased up where the fingers of a hanging hand would go through the floor
        height, hand = goal[:, 1], pose.body.proportions.hand
        least, width = 1.05 * hand, 0.1 * hand
        goal[:, 1] = 0.5 * (height + least + np.sqrt((height - least) ** 2 + width * width))
    for part, _, wrist, far in arm.touches:
        there = pose.at(part) + rotated(pose.of(part), wrist)
        goal = goal + far[:, None] * (there - goal)
    for way, far, _ in arm.contacts:
        goal = goal + far[:, None] * (way - goal)
    return goal


def _oriented(pose: Pose, arms: Sequence[Arm], lower: np.ndarray) -> np.ndarray:
    """Orientations ``(arms, frames, 3, 3)`` of hands on forearms that are turned so."""
    oriented = lower @ np.stack([arm.wrist for arm in arms])
    still = (lower[0], np.zeros(lower.shape[1]))
    holds = [
        [*arm.aim, *((pose.of(part) @ turn, far) for part, turn, _, far in arm.touches)]
        + [hold for _, _, hold in arm.contacts]
        for arm in arms
    ]
    for each in zip_longest(*holds, fillvalue=still):
        turns, shares = (np.stack(rows) for rows in zip(*each, strict=True))
        if shares.any():
            oriented = part_way(oriented, turns, shares)
    return oriented


def _aimed(aim: np.ndarray, side: str) -> np.ndarray:
    """Orientations ``(frames, 3, 3)`` of a hand whose palm and fingers point in given directions."""
    out = np.array([sign(side), 1.0, 1.0])
    back = -unit(aim[:, :3] * out)
    fingers = aim[:, 3:] * out
    x = sign(side) * unit(fingers - back * dot(fingers, back))
    return np.stack([x, back, cross(x, back)], axis=-1)


def _collar(chest: np.ndarray, line: np.ndarray, outward: np.ndarray, ease: float) -> np.ndarray:
    """Turns of collar bones ``(arms, frames, 3, 3)``: up to 20 degrees up and 15 forward, after the arm.

    line: ``(arms, frames, 3)`` from shoulder joint to wrist, arm lengths. outward: ``(arms, 1)`` signs."""
    line = rotated(np.swapaxes(chest, -1, -2), line)
    up = np.radians(22.0) * ease * smooth((line[..., 1] + 0.6) / 1.8)
    ahead = np.radians(20.0) * ease * (smooth((line[..., 2] + 0.9) / 1.9) - smooth(0.9 / 1.9))
    return about(1, -outward * ahead) @ about(2, outward * up)
