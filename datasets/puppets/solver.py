"""One performance on one body: full-body inverse kinematics in closed form, over all frames at once.

From the floor up: feet follow their plants; the pelvis goes where the score and the balance want it, no
higher than both feet reach; the spine shares the trunk's bend, and bends further where a hand has to
touch something out of reach; legs, collar bones and arms follow. Balance and spine depend on each other,
so the whole is passed over a fixed number of times; nothing stops early, and no choice is made between
near equals, so results do not depend on a machine's last digits.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from . import aloft, anatomy, flight, handplants, hands, kneeling
from .bodies import Body
from .curves import lower_envelope, smooth, soft_min
from .feet import FootPath, foot_path, labels
from .limbs import about, bend, from_vector, part_way
from .scaling import pelvis_place
from .score import SIDES, Score, Trunk


@dataclass(frozen=True)
class Manner:
    """How a body does what the score leaves open. Another manner is another right answer.

    knees:  share of a foot's turn against the pelvis that the knee follows.
    elbows: turns both elbows outward and up, radians.
    lower_back: share of the trunk's bend moved from the upper to the lower spine.
    collar: how readily the collar bones follow the arms.
    pelvis: share of the pelvis' own turns that the spine makes in its stead; the chest stays as it is.
    ahead: how much farther forward on the soles the balance is kept, from ankle (0) to toe joint (1).
    """

    knees: float = 0.7
    elbows: float = 0.0
    lower_back: float = 0.0
    collar: float = 1.0
    pelvis: float = 0.0
    ahead: float = 0.0

    def led(self, trunk: Trunk) -> Trunk:
        """The trunk's angles with the pelvis' share handed to the spine."""
        handed = self.pelvis * trunk.pelvis
        return replace(trunk, pelvis=trunk.pelvis - handed, chest=trunk.chest + handed)


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
    score = replace(score, trunk=manner.led(score.trunk))
    feet = {side: foot_path(score.feet[side], side, body, score.frames) for side in SIDES}
    touching = any(hand.touches for hand in score.hands.values())
    state = _State.start(score.frames)
    passes = 4 if touching or score.balance.any() or score.flights else 1
    low = hands.reaches_down(score, body) or handplants.any_planted(score)
    for _ in range(8 if low else passes):
        pose = _pose(score, body, manner, feet, state)
        state = _adjusted(score, body, manner, state, pose)
    return Solution(pose.turned, pose.places[:, 0], *labels(feet))


@dataclass(frozen=True, eq=False)
class _State:
    """What the passes agree on: the pelvis' shift ``(frames, 2)`` for balance, metres, the trunk's
    additional lean ``(frames,)``, radians, how far the hips sink for a hand that is to reach down
    ``(frames,)``, metres, how far the pelvis is off its height ``(frames,)``, metres, for
    the centre of mass to fall freely, where the centre of mass was before any shift, and how much the hips
    sink ``(frames,)``, metres, for hands that are planted on the floor."""

    shift: np.ndarray
    lean: np.ndarray
    low: np.ndarray
    thrown: np.ndarray
    unbalanced: np.ndarray | None = None
    crouch: np.ndarray | float = 0.0

    @classmethod
    def start(cls, frames: int) -> _State:
        return cls(np.zeros((frames, 2)), np.zeros(frames), np.zeros(frames), np.zeros(frames))


@dataclass(eq=False)
class Pose:
    """A pose in the making: orientations and places are filled in from the root outward.
    missing: ``(frames,)`` metres by which a hand that reaches down falls short, below 0 where it has
    room to spare, and minus infinity where none reaches down; short: how far short each hand is, whatever
    it does."""

    body: Body
    turned: np.ndarray
    places: np.ndarray
    missing: np.ndarray
    short: dict[str, np.ndarray] = field(default_factory=dict)

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


def _pose(score: Score, body: Body, manner: Manner, feet: dict[str, FootPath], state: _State) -> Pose:
    joints = len(body.structure.parts)
    frames = score.frames
    turned, places = np.zeros((frames, joints, 3, 3)), np.zeros((frames, joints, 3))
    pose = Pose(body, turned, places, np.full(frames, -np.inf))
    _set_pelvis(pose, score, feet, state)
    _set_spine(pose, score, manner, state)
    for side in SIDES:
        _set_leg(pose, side, score, manner, feet[side])
    for side in hands.order(score):
        hands.set_arm(pose, side, score, manner)
    return pose


# --------------------------------------------------------------------------------------- trunk
def _set_pelvis(pose: Pose, score: Score, feet: dict[str, FootPath], state: _State) -> None:
    body, trunk = pose.body, score.trunk
    turn = about(1, score.heading + trunk.pelvis[:, 0])
    lean = trunk.pelvis[:, 1]
    if score.prone is not None:
        lean = lean + score.prone * kneeling.all_fours(body)[0]
    turn = turn @ about(0, lean) @ about(2, -trunk.pelvis[:, 2])
    middle = pelvis_place(score, body)
    middle[:, [0, 2]] += state.shift
    middle[:, 1] -= _up_to(_MOST_LOW * body.proportions.leg, state.low)
    middle[:, 1] -= handplants.eased(state.crouch, body)
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
    middle[:, 1] = kneeling.over_floor(middle[:, 1], body)
    from_hips = {side: offsets[side] - from_middle for side in SIDES}
    middle = kneeling.on_knees(score, middle, from_hips, feet, body)
    pose.places[:, 0] = middle - from_middle
    pose.set("hips", turn)


def _set_spine(pose: Pose, score: Score, manner: Manner, state: _State) -> None:
    structure, trunk = pose.body.structure, score.trunk
    turn, lean, left = (
        trunk.chest[:, 0],
        trunk.chest[:, 1] + _up_to(_MOST_LEAN, state.lean),
        trunk.chest[:, 2],
    )
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
def _set_leg(pose: Pose, side: str, score: Score, manner: Manner, foot: FootPath) -> None:
    hip, hips = pose.at(f"{side}_up_leg"), pose.of("hips")
    turned_in = score.heading + score.trunk.pelvis[:, 0] - foot.yaw
    swivel = aloft.swivel(score, side, manner.knees * turned_in)
    limb, goal = anatomy.leg(pose.body), aloft.ankle(score, side, hip, foot, pose.body)
    pole = None
    if score.feet[side].kneel is not None:
        pole = (kneeling.resting(foot, pose.body), kneeling.kneels(score, side))
    thigh, shank = bend(limb, hip, goal, hips, swivel, pole)
    for _ in range(0 if score.feet[side].air is None else 2):
        goal = aloft.clear(goal, *aloft.sole(score, side, shank, foot, pose.body), foot, pose.body)
        thigh, shank = bend(limb, hip, goal, hips, swivel)
    sole, toes = aloft.sole(score, side, shank, foot, pose.body)
    pose.set(f"{side}_up_leg", thigh)
    pose.set(f"{side}_leg", shank)
    pose.set(f"{side}_foot", sole)
    pose.set(f"{side}_toe", toes)


# ------------------------------------------------------------------------------------- passes
_MOST_LEAN = 0.35
"""How far the spine bends, radians, for hands that would not reach otherwise."""
_MOST_LOW = 0.4
"""How far the hips sink for them, leg lengths."""


def _up_to(most: float, value: np.ndarray) -> np.ndarray:
    """Values that are asked for, eased below a limit."""
    return most * np.tanh(value / most)


def _adjusted(score: Score, body: Body, manner: Manner, state: _State, pose: Pose) -> _State:
    """The next pass' shift and lean, from what this pass lacked."""
    centre = anatomy.centre_of_mass(body, pose.places)[:, [0, 2]]
    under = np.zeros_like(centre)
    for side, share in zip(SIDES, (score.support, 1.0 - score.support), strict=True):
        ankle, toe = pose.at(f"{side}_foot"), pose.at(f"{side}_toe")
        # the middle of the sole; the toes where the heel is off the floor
        on_toes = smooth(score.feet[side].heel / 0.25)
        along = 0.4 + manner.ahead + (0.55 - manner.ahead) * on_toes
        under += share[:, None] * (ankle + along[:, None] * (toe - ankle))[:, [0, 2]]
    under = flight.carried_over(score, under)
    free = centre if state.unbalanced is None else state.unbalanced
    shift = state.shift + free + score.balance[:, None] * (under - free) - centre
    lever = body.structure.lever * body.proportions.trunk
    missing = np.where(np.isfinite(pose.missing), pose.missing, 0.0)
    lean = -lower_envelope(-np.maximum(state.lean + 0.7 * missing / lever, 0.0), 4)
    # the less the spine bends further, the more the knees do
    share = 0.25 + 0.75 * np.tanh(state.lean / _MOST_LEAN) ** 2
    low = -lower_envelope(-np.maximum(state.low + share * missing, 0.0), 4)
    crouch = state.crouch + handplants.crouching(score, pose.short)
    return _State(shift, lean, low, flight.fall(score, body, pose.places), free, crouch)
