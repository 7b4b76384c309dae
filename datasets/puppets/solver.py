"""One performance on one body: full-body inverse kinematics in closed form, over all frames at once.

From the floor up: feet follow their plants; the pelvis goes where the score and the balance want it, no
higher than both feet reach; the spine shares the trunk's bend, and bends further where a hand has to
touch something out of reach; legs, collar bones and arms follow. Balance and spine depend on each other,
so the whole is passed over a fixed number of times; nothing stops early, and no choice is made between
near equals, so results do not depend on a machine's last digits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from . import anatomy, flight, handplants, hands, legs, trunk
from .bodies import Body
from .curves import lower_envelope, smooth
from .feet import FootPath, foot_path, labels
from .hands import HandPlan
from .legs import LegPlan
from .posing import Pose, State
from .score import SIDES, Score, Trunk
from .trunk import TrunkPlan


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
    asked, state = _Plan.of(score, body, manner, feet), State.start(score.frames)
    pose = _pose(score, body, manner, asked, state)
    for _ in range(_passes(score, body) - 1):
        state = _adjusted(score, body, asked, state, pose)
        pose = _pose(score, body, manner, asked, state)
    turned = np.ascontiguousarray(pose.turned.swapaxes(0, 1))
    return Solution(turned, pose.places[0], *labels(feet))


def _passes(score: Score, body: Body) -> int:
    """How often the whole is gone through."""
    if hands.reaches_down(score, body) or handplants.any_planted(score):
        return 8
    touching = any(hand.touches for hand in score.hands.values())
    return 4 if touching or score.balance.any() or score.flights else 1


@dataclass(frozen=True, eq=False)
class _Plan:
    """What a score asks of a body, worked out once for all passes.

    support: ``(2, frames, 1)`` shares of the feet in what the balance is over; along: ``(2, frames, 1)``
    where that is on their soles, from ankle (0) to toe joint (1)."""

    trunk: TrunkPlan
    legs: LegPlan
    hands: Mapping[str, HandPlan]
    support: np.ndarray
    along: np.ndarray

    @classmethod
    def of(cls, score: Score, body: Body, manner: Manner, feet: Mapping[str, FootPath]) -> _Plan:
        asked = trunk.plan(score, body, feet)
        # the middle of the sole; the toes where the heel is off the floor
        on_toes = smooth(np.stack([score.feet[side].heel for side in SIDES]) / 0.25)
        return cls(
            asked,
            legs.plan(score, feet, manner.knees, asked.knees),
            {side: hands.plan(score, side, body, manner) for side in SIDES},
            np.stack([score.support, 1.0 - score.support])[..., None],
            (0.4 + manner.ahead + (0.55 - manner.ahead) * on_toes)[..., None],
        )


def _pose(score: Score, body: Body, manner: Manner, asked: _Plan, state: State) -> Pose:
    pose = Pose.start(body, score.frames)
    trunk.set_pelvis(pose, score, asked.trunk, state)
    trunk.set_spine(pose, score, asked.trunk, manner.lower_back, state)
    legs.set_legs(pose, score, asked.legs)
    for sides in hands.order(score):
        hands.set_arms(pose, [asked.hands[side] for side in sides], manner.collar)
    return pose


def _adjusted(score: Score, body: Body, asked: _Plan, state: State, pose: Pose) -> State:
    """The next pass' shift and lean, from what this pass lacked."""
    places = pose.places.swapaxes(0, 1)
    centre = anatomy.centre_of_mass(body, places)[:, 0::2]
    ankle, toe = pose.both("foot")[..., 0::2], pose.both("toe")[..., 0::2]
    under = (asked.support * (ankle + asked.along * (toe - ankle))).sum(axis=0)
    under = flight.carried_over(score, under)
    free = centre if state.unbalanced is None else state.unbalanced
    shift = state.shift + free + score.balance[:, None] * (under - free) - centre
    lever = body.structure.lever * body.proportions.trunk
    missing = np.where(np.isfinite(pose.missing), pose.missing, 0.0)
    lean = -lower_envelope(-np.maximum(state.lean + 0.7 * missing / lever, 0.0), 4)
    # the less the spine bends further, the more the knees do
    share = 0.25 + 0.75 * np.tanh(state.lean / trunk.MOST_LEAN) ** 2
    low = -lower_envelope(-np.maximum(state.low + share * missing, 0.0), 4)
    crouch = state.crouch + handplants.crouching(score, pose.short)
    return State(shift, lean, low, flight.fall(score, body, places), free, crouch)
