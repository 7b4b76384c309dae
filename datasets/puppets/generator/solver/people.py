"""People: what a performance asks of a body on two legs, and its poses, from the floor up.

Feet follow their contacts; the pelvis goes where score and balance want it, no higher than both feet
reach; the spine shares the trunk's bend, and bends further where a hand has to touch something out of
reach; legs, collar bones and arms follow. Balance and spine depend on each other, so there are several
passes.

From the last touch of the floor to the next the centre of mass falls as thrown things do. The score's
height has the parabola of a flight in it; gravity is the same in leg lengths for every body.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...contract import SECOND, USUAL, Manner
from ..bodies.structures import Body
from ..conventions import SIDES, sign
from ..curves import lower_envelope, smooth, soft_min
from ..matrices import about, part_way, rotated
from ..performances.score import Score
from . import hands, kneeling
from .feet import air_ankle, air_sole, clear_of_floor, foot_path
from .limbs import bend, centre_of_mass, leg_limb
from .pose import Pose
from .scaling import pelvis_place
from .touch_points import LOW, touch_point

MOST_LEAN = 0.35
"""How far the spine bends, radians, for hands that would not reach otherwise."""
_MOST_LOW = 0.4
"""How far the hips sink for them, leg lengths."""
_MOST_CROUCH = 0.34
"""How far the hips sink for planted hands, leg lengths."""


@dataclass(frozen=True)
class PersonManner:
    """A body's way to do what the score leaves open. Another manner is another right answer.

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


MANNERS: Mapping[Manner, PersonManner] = {
    USUAL: PersonManner(),
    SECOND: PersonManner(knees=0.5, elbows=0.17, lower_back=0.08, collar=0.75, pelvis=0.15, ahead=0.1),
}
"""The second answer's is as far from the usual one as goes unnoticed: whoever sees only the performance
would call it the same."""


class Person:
    """The demands of a score on a body, computed once, and corrections that grow from pass to pass."""

    def __init__(self, score: Score, body: Body, manner: PersonManner) -> None:
        self.body, self.manner, trunk = body, manner, score.trunk
        handed = manner.pelvis * trunk.pelvis
        trunk = replace(trunk, pelvis=trunk.pelvis - handed, chest=trunk.chest + handed)
        self.score = score = replace(score, trunk=trunk)
        self.paths = {side: foot_path(score.feet[side], side, body, score.frames) for side in SIDES}
        self.arms = {side: hands.Arm(score, side, body, manner.elbows) for side in SIDES}
        self.order = hands.order(score)
        # orientations (frames, 3, 3) of pelvis and head
        lean = trunk.pelvis[:, 1]
        if score.prone is not None:
            lean = lean + score.prone * kneeling.all_fours(body)[0]
        facing = score.heading + trunk.pelvis[:, 0]
        self.pelvis = about(1, facing) @ about(0, lean) @ about(2, -trunk.pelvis[:, 2])
        follow = trunk.follow * (trunk.pelvis[:, 0] + trunk.chest[:, 0])
        head = about(1, score.heading + trunk.gaze[:, 0] + follow)
        self.head = head @ about(0, trunk.gaze[:, 1]) @ about(2, -trunk.gaze[:, 2])
        # metres: the middle between the hip joints, and from there to the root and to either hip joint
        self.middle = pelvis_place(score, body)
        hips = np.stack([rotated(self.pelvis, body.reach(f"{side}_up_leg", "hips")) for side in SIDES])
        self.to_root = -0.5 * (hips[0] + hips[1])
        self.to_hips = hips + self.to_root
        # (2, frames): how the knees turn, and how far each foot holds nothing down, since it is thrown
        # along with the body or carried
        self.swivel, self.free = np.zeros((2, score.frames)), np.zeros((2, score.frames))
        for k, side in enumerate(SIDES):
            foot, air = self.paths[side], score.feet[side].air
            self.swivel[k] = manner.knees * (facing - foot.yaw)
            if score.flights:
                self.free[k] = foot.swinging
            if air is not None:
                self.swivel[k] += air.weight * (sign(side) * air.swivel - self.swivel[k])
                self.free[k] = np.maximum(self.free[k], air.weight)
        # resting knees: where they are, and how far they rest there
        self.knees, self.pole = kneeling.knees(score, self.paths, body), None
        if self.knees is not None:
            # a foot that is carried somewhere has its own way of turning the knee
            kneels = [kneeling.kneels(score, side) * (score.feet[side].air is None) for side in SIDES]
            self.pole = (self.knees, np.stack(kneels))
        # (2, frames, 1): shares of the feet in what the balance is over, and where that is on their soles,
        # from ankle (0) to toe joint (1): the middle; the toes where the heel is off the floor
        on_toes = smooth(np.stack([score.feet[side].heel for side in SIDES]) / 0.25)
        self.support = np.stack([score.support, 1.0 - score.support])[..., None]
        self.along = (0.4 + manner.ahead + (0.55 - manner.ahead) * on_toes)[..., None]
        # metres: the pelvis' shift (frames, 2) for balance, where the centre of mass was before any, and
        # (frames,) how far the pelvis is off its height for the centre of mass to fall freely
        self.shift = np.zeros((score.frames, 2))
        self.unbalanced: np.ndarray | None = None
        self.thrown = np.zeros(score.frames)
        # (frames,): the trunk's additional lean, radians, and how far the hips sink for a hand that is to
        # reach down and for hands planted on the floor, metres
        self.lean, self.low, self.crouch = np.zeros((3, score.frames))

    @property
    def passes(self) -> int:
        """Number of passes."""
        score, all_hands = self.score, self.score.hands.values()
        touched = [touch_point(touch.place, self.body).part for hand in all_hands for touch in hand.touches]
        if any(part in LOW for part in touched) or any(hand.contacts for hand in all_hands):
            return 8
        return 4 if touched or score.balance.any() or score.flights else 1

    def pose(self) -> Pose:
        """The pose with the corrections so far."""
        pose = Pose(self.body, self.score.frames)
        self._set_pelvis(pose)
        self._set_spine(pose)
        self._set_legs(pose)
        for sides in self.order:
            hands.set_arms(pose, [self.arms[side] for side in sides], self.manner.collar)
        return pose

    def adjust(self, pose: Pose) -> None:
        """Corrections for the next pass, from what a pose lacked."""
        score, body = self.score, self.body
        centre = centre_of_mass(body, pose.positions.swapaxes(0, 1))
        ankle, toe = pose.both("foot")[..., 0::2], pose.both("toe")[..., 0::2]
        under = (self.support * (ankle + self.along * (toe - ankle))).sum(axis=0)
        under = np.stack([_chords(score.flights, row) for row in under.T], axis=-1)
        if self.unbalanced is None:
            self.unbalanced = centre[:, 0::2]
        correction = score.balance[:, None] * (under - self.unbalanced)
        self.shift = self.shift + self.unbalanced + correction - centre[:, 0::2]
        hips = pose.both("up_leg")[..., 1]
        above = centre[:, 1] - 0.5 * (hips[0] + hips[1])
        # outside of flights the line is the curve itself
        self.thrown = _chords(score.flights, above) - above
        lever = body.structure.lever * body.proportions.trunk
        missing = np.where(np.isfinite(pose.missing), pose.missing, 0.0)
        # the less the spine bends further, the more the knees do
        share = 0.25 + 0.75 * np.tanh(self.lean / MOST_LEAN) ** 2
        self.lean = -lower_envelope(-np.maximum(self.lean + 0.7 * missing / lever, 0.0), 4)
        self.low = -lower_envelope(-np.maximum(self.low + share * missing, 0.0), 4)
        self.crouch = self.crouch + hands.crouching(score, pose.short)

    def _set_pelvis(self, pose: Pose) -> None:
        score, leg = self.score, self.body.proportions.leg
        limb = leg_limb(self.body, score.slack)
        middle, length = self.middle.copy(), limb.exact * limb.longest
        middle[:, 0::2] += self.shift
        middle[:, 1] -= _up_to(_MOST_LOW * leg, self.low) + _up_to(_MOST_CROUCH * leg, self.crouch)
        ankles = np.stack([self.paths[side].ankle for side in SIDES])
        flat = ((middle + self.to_hips - ankles)[..., 0::2] ** 2).sum(axis=-1)
        rise = np.sqrt(np.maximum(length * length - flat, 0.01 * length * length))
        caps = ankles[..., 1] + rise - self.to_hips[..., 1] + 0.5 * leg * self.free
        cap = lower_envelope(np.minimum(caps[0], caps[1]), 2)
        reached = soft_min(middle[:, 1], cap, 0.008 * leg * score.slack)
        if score.flights:
            # a flight goes as it was wanted, moved so that both ends fit
            reached = _chords(score.flights, reached - middle[:, 1]) + middle[:, 1]
        middle[:, 1] = kneeling.over_floor(reached + self.thrown, self.body)
        if self.knees is not None:
            middle = kneeling.on_knees(score, middle, self.to_hips, self.knees, self.body)
        pose.positions[0] = middle + self.to_root
        pose.set("hips", self.pelvis)

    def _set_spine(self, pose: Pose) -> None:
        chest = self.score.trunk.chest
        bend = np.stack([chest[:, 1] + _up_to(MOST_LEAN, self.lean), chest[:, 0], -chest[:, 2]], axis=-1)
        pose.bend_spine(self.pelvis, bend, self.manner.lower_back)
        pose.set("neck", part_way(pose.of(self.body.structure.chest), self.head, np.array(0.45)))
        pose.set("head", self.head)

    def _set_legs(self, pose: Pose) -> None:
        """Thighs, shanks, feet and toes."""
        score, body, feet = self.score, self.body, self.paths
        limbs, hips, hip = (leg_limb(body, score.slack),) * 2, pose.of("hips"), pose.both("up_leg")
        goal = np.stack(
            [air_ankle(score, side, at, feet[side], body) for side, at in zip(SIDES, hip, strict=True)]
        )
        thigh, shank = bend(limbs, hip, goal, hips, self.swivel, self.pole)
        carried = [(k, side) for k, side in enumerate(SIDES) if score.feet[side].air is not None]
        for _ in range(2 if carried else 0):
            for k, side in carried:
                soles = air_sole(score, side, shank[k], feet[side], body)
                goal[k] = clear_of_floor(goal[k], *soles, feet[side], body)
            thigh, shank = bend(limbs, hip, goal, hips, self.swivel, self.pole)
        pose.set_both("up_leg", thigh)
        pose.set_both("leg", shank)
        for side, turn in zip(SIDES, shank, strict=True):
            sole, toes = air_sole(score, side, turn, feet[side], body)
            pose.set(f"{side}_foot", sole)
            pose.set(f"{side}_toe", toes)


def _up_to(most: float, value: np.ndarray) -> np.ndarray:
    """Values eased below a limit."""
    return most * np.tanh(value / most)


def _chords(flights: Sequence[tuple[int, int]], curve: np.ndarray) -> np.ndarray:
    """``curve`` ``(frames,)``, but in flights the straight line between its values at both ends; a flight
    that a clip cuts off keeps the value at the end that is there."""
    line, frames = curve.copy(), np.arange(len(curve))
    for off, strike in flights:
        inside = (frames > off) & (frames < strike)
        first, last = max(off, 0), min(strike, len(frames) - 1)
        values = curve[[first if off >= 0 else last, last if strike < len(frames) else first]]
        line[inside] = values[0] + (values[1] - values[0]) * (frames[inside] - off) / (strike - off)
    return line
