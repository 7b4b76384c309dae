"""One performance on one body: full-body inverse kinematics in closed form, over all frames at once.

From the floor up: feet follow their plants; the pelvis goes where the score and the balance want it, no
higher than both feet reach; the spine shares the trunk's bend, and bends further where a hand has to
touch something out of reach; legs, collar bones and arms follow. Balance and spine depend on each other,
so the whole is passed over a fixed number of times; nothing stops early, and no choice is made between
near equals, so results do not depend on a machine's last digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import aloft, anatomy, flight
from .bodies import Body
from .curves import lower_envelope, smooth, soft_min
from .feet import FootPath, foot_path, labels
from .limbs import about, bend, from_vector, part_way
from .places import LOW, OF_ARM, place, resting
from .scaling import hand_reach, pelvis_place
from .score import SIDES, Hand, Score, sign


@dataclass(frozen=True)
class Manner:
    """How a body does what the score leaves open. Another manner is another right answer.

    knees:  share of a foot's turn against the pelvis that the knee follows.
    elbows: turns both elbows outward and up, radians.
    lower_back: share of the trunk's bend moved from the upper to the lower spine.
    collar: how readily the collar bones follow the arms.
    """

    knees: float = 0.7
    elbows: float = 0.0
    lower_back: float = 0.0
    collar: float = 1.0


@dataclass(frozen=True, eq=False)
class Solution:
    """turned: ``(frames, joints, 3, 3)`` world orientations against the T-pose. root: ``(frames, 3)``.
    planted: ``(frames, 4)`` bool: left ankle, left toe joint, right ankle, right toe joint. pivoting:
    likewise, which of them turn about a resting point of the foot; nothing: none does."""

    turned: np.ndarray
    root: np.ndarray
    planted: np.ndarray
    pivoting: np.ndarray | None = None


def solve(score: Score, body: Body, manner: Manner = Manner()) -> Solution:
    """The performance of ``score`` by ``body``."""
    feet = {side: foot_path(score.feet[side], side, body, score.frames) for side in SIDES}
    touching = any(hand.touches for hand in score.hands.values())
    state = _State.start(score.frames)
    for _ in range(4 if touching or score.balance.any() or score.flights else 1):
        pose = _pose(score, body, manner, feet, state)
        state = _adjusted(score, body, state, pose)
    return Solution(pose.turned, pose.places[:, 0], *labels(feet))


@dataclass(frozen=True, eq=False)
class _State:
    """What the passes agree on: the pelvis' shift ``(frames, 2)`` for balance, metres, the trunk's
    additional lean ``(frames,)``, radians, how far the pelvis is off its height ``(frames,)``, metres, for
    the centre of mass to fall freely, and where the centre of mass was before any shift."""

    shift: np.ndarray
    lean: np.ndarray
    thrown: np.ndarray
    unbalanced: np.ndarray | None = None

    @classmethod
    def start(cls, frames: int) -> _State:
        return cls(np.zeros((frames, 2)), np.zeros(frames), np.zeros(frames))


@dataclass(eq=False)
class _Pose:
    """A pose in the making: orientations and places are filled in from the root outward.
    missing: ``(frames,)`` metres by which a touching hand falls short."""

    body: Body
    turned: np.ndarray
    places: np.ndarray
    missing: np.ndarray

    def set(self, part: str, turned: np.ndarray) -> None:
        """Orient a joint; its children's places follow."""
        joint = self.body.part[part]
        self.turned[:, joint] = turned
        for child, parent in enumerate(self.body.structure.parents):
            if parent == joint:
                self.places[:, child] = self.places[:, joint] + turned @ self.body.offsets[child]
                if self.body.structure.parts[child] in self.body.structure.silent:
                    self.set(self.body.structure.parts[child], turned)

    def at(self, part: str) -> np.ndarray:
        return self.places[:, self.body.part[part]]

    def of(self, part: str) -> np.ndarray:
        return self.turned[:, self.body.part[part]]


def _pose(score: Score, body: Body, manner: Manner, feet: dict[str, FootPath], state: _State) -> _Pose:
    joints = len(body.structure.parts)
    frames = score.frames
    pose = _Pose(body, np.zeros((frames, joints, 3, 3)), np.zeros((frames, joints, 3)), np.zeros(frames))
    _set_pelvis(pose, score, feet, state)
    _set_spine(pose, score, manner, state)
    for side in SIDES:
        _set_leg(pose, side, score, manner, feet[side])
    for side in _order(score):
        _set_arm(pose, side, score, manner)
    return pose


def _order(score: Score) -> tuple[str, ...]:
    """A hand that rests on the other arm comes after it; where each does at its own time, one comes twice."""
    left_first, right_first = (
        any(touch.place in OF_ARM[other] for touch in score.hands[side].touches)
        for side, other in (("right", "left"), ("left", "right"))
    )
    if left_first and right_first:
        return ("right", "left", "right")
    return SIDES[::-1] if right_first else SIDES


# --------------------------------------------------------------------------------------- trunk
def _set_pelvis(pose: _Pose, score: Score, feet: dict[str, FootPath], state: _State) -> None:
    body, trunk = pose.body, score.trunk
    turn = about(1, score.heading + trunk.pelvis[:, 0])
    turn = turn @ about(0, trunk.pelvis[:, 1]) @ about(2, -trunk.pelvis[:, 2])
    middle = pelvis_place(score, body)
    middle[:, [0, 2]] += state.shift
    offsets = {side: turn @ body.reach(f"{side}_up_leg", "hips") for side in SIDES}
    from_middle = 0.5 * (offsets["left"] + offsets["right"])
    caps = []
    for side in SIDES:
        limb = anatomy.leg(body)
        hip = middle - from_middle + offsets[side]
        flat = ((hip - feet[side].ankle)[:, [0, 2]] ** 2).sum(axis=-1)
        length = limb.exact * limb.longest
        rise = np.sqrt(np.maximum(length * length - flat, 0.01 * length * length))
        free = flight.unbound(score, side, feet[side], body)
        caps.append(feet[side].ankle[:, 1] + rise - (hip - middle)[:, 1] + free)
    leg = body.proportions.leg
    cap = lower_envelope(np.minimum(caps[0], caps[1]), 2)
    reached = soft_min(middle[:, 1], cap, 0.008 * leg)
    middle[:, 1] = flight.bridged(score, middle[:, 1], reached) + state.thrown
    pose.places[:, 0] = middle - from_middle
    pose.set("hips", turn)


def _set_spine(pose: _Pose, score: Score, manner: Manner, state: _State) -> None:
    structure, trunk = pose.body.structure, score.trunk
    turn, lean, left = trunk.chest[:, 0], trunk.chest[:, 1] + state.lean, trunk.chest[:, 2]
    whole = np.stack([lean, turn, -left], axis=-1)
    below = pose.of("hips")
    low, high = structure.bending[0][0], structure.bending[-1][0]
    for part, share in structure.bending:
        share += manner.lower_back * ((part == low) - (part == high))
        below = below @ from_vector(share * whole)
        pose.set(part, below)
    chest = pose.of(structure.chest)
    follow = trunk.follow * (trunk.pelvis[:, 0] + turn)
    head = about(1, score.heading + trunk.gaze[:, 0] + follow)
    head = head @ about(0, trunk.gaze[:, 1]) @ about(2, -trunk.gaze[:, 2])
    pose.set("neck", part_way(chest, head, np.full(score.frames, 0.45)))
    pose.set("head", head)


# --------------------------------------------------------------------------------------- limbs
def _set_leg(pose: _Pose, side: str, score: Score, manner: Manner, foot: FootPath) -> None:
    turned_in = score.heading + score.trunk.pelvis[:, 0] - foot.yaw
    thigh, shank = bend(
        anatomy.leg(pose.body),
        pose.at(f"{side}_up_leg"),
        aloft.ankle(score, side, pose.at(f"{side}_up_leg"), foot, pose.body),
        pose.of("hips"),
        aloft.swivel(score, side, manner.knees * turned_in),
    )
    sole, toes = aloft.sole(score, side, shank, foot)
    pose.set(f"{side}_up_leg", thigh)
    pose.set(f"{side}_leg", shank)
    pose.set(f"{side}_foot", sole)
    pose.set(f"{side}_toe", toes)


def _set_arm(pose: _Pose, side: str, score: Score, manner: Manner) -> None:
    body, hand, limb = pose.body, score.hands[side], anatomy.arm(side, pose.body)
    chest = pose.of(body.structure.chest)
    goal, rest, weight = _goal(pose, side, score)
    pose.set(f"{side}_shoulder", chest)
    if body.structure.collars:
        pose.set(f"{side}_shoulder", chest @ _collar(pose, side, goal, limb.longest, manner.collar))
    start = pose.at(f"{side}_arm")
    far = np.sqrt(((goal - start) ** 2).sum(axis=-1)) - 0.99 * limb.exact * limb.longest
    pose.missing = np.maximum(pose.missing, _helped_by_leaning(hand, body) * np.maximum(far, 0.0))
    swivel = sign(side) * (hand.swivel + manner.elbows)
    upper, lower = bend(limb, start, goal, chest, swivel)
    free = lower @ _wrist(hand, side)
    turned = part_way(free, rest, weight) if weight.any() else free
    # most of the hand's twist happens along the forearm
    relative = np.swapaxes(lower, -1, -2) @ turned
    twist = np.arctan2(relative[:, 2, 1] - relative[:, 1, 2], relative[:, 1, 1] + relative[:, 2, 2])
    pose.set(f"{side}_arm", upper)
    pose.set(f"{side}_forearm", lower @ about(0, 0.6 * twist))
    pose.set(f"{side}_hand", turned)


def _helped_by_leaning(hand: Hand, body: Body) -> np.ndarray:
    """``(frames,)`` how far a hand is put on something that bending forward brings nearer."""
    low = [touch.weight for touch in hand.touches if place(touch.place, body).part in LOW]
    return sum(low, start=np.zeros(len(hand.swivel)))


def _goal(pose: _Pose, side: str, score: Score) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the wrist goes, and how far ``(frames,)`` the hand is turned to rest on a place, and how."""
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
    rest, weight = chest, np.zeros(score.frames)
    for touch in hand.touches:
        spot = place(touch.place, body)
        turn, wrist = resting(spot, side, body.proportions)
        there = pose.at(spot.part) + _apply(pose.of(spot.part), np.broadcast_to(wrist, goal.shape))
        goal = goal + touch.weight[:, None] * (there - goal)
        rest, weight = pose.of(spot.part) @ turn, weight + touch.weight
    return goal, rest, weight


def _collar(pose: _Pose, side: str, goal: np.ndarray, arm: float, ease: float) -> np.ndarray:
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


# ------------------------------------------------------------------------------------- passes
_MOST_LEAN = 0.4
"""How far the spine bends, radians, for hands that would not reach otherwise."""


def _adjusted(score: Score, body: Body, state: _State, pose: _Pose) -> _State:
    """The next pass' shift and lean, from what this pass lacked."""
    centre = anatomy.centre_of_mass(body, pose.places)[:, [0, 2]]
    under = np.zeros_like(centre)
    for side, share in zip(SIDES, (score.support, 1.0 - score.support), strict=True):
        ankle, toe = pose.at(f"{side}_foot"), pose.at(f"{side}_toe")
        # the middle of the sole; the toes where the heel is off the floor
        along = 0.4 + 0.55 * smooth(score.feet[side].heel / 0.25)
        under += share[:, None] * (ankle + along[:, None] * (toe - ankle))[:, [0, 2]]
    free = centre if state.unbalanced is None else state.unbalanced
    shift = state.shift + free + score.balance[:, None] * (under - free) - centre
    lever = body.structure.lever * body.proportions.trunk
    need = -lower_envelope(-state.lean - pose.missing / lever, 4)
    lean = _MOST_LEAN * np.tanh(need / _MOST_LEAN)
    return _State(shift, lean, flight.fall(score, body, pose.places), free)
