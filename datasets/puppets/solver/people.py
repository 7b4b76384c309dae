"""One performance on one body: full-body inverse kinematics in closed form, over all frames at once.

From the floor up: feet follow their plants; the pelvis goes where the score and the balance want it, no
higher than both feet reach; the spine shares the trunk's bend, and bends further where a hand has to
touch something out of reach; legs, collar bones and arms follow. Balance and spine depend on each other,
so the whole is passed over a fixed number of times; nothing stops early, and no choice is made between
near equals, so results do not depend on a machine's last digits.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..bodies.structures import Body
from ..conventions import SIDES
from ..curves import lower_envelope, smooth, soft_min
from ..matrices import about, from_vector, part_way, rotated
from ..performances.score import Score, Trunk
from . import flight, hands, kneeling
from .feet import FootPath, air_ankle, air_sole, air_swivel, clear_of_floor, foot_path, labels
from .hands import HandPlan
from .limbs import bend_all, centre_of_mass, leg_limb
from .pose import Pose, Solution
from .scaling import pelvis_place

MOST_LEAN = 0.35
"""How far the spine bends, radians, for hands that would not reach otherwise."""
_MOST_LOW = 0.4
"""How far the hips sink for them, leg lengths."""


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


def solve(score: Score, body: Body, manner: Manner = Manner()) -> Solution:
    """The performance of ``score`` by ``body``."""
    score = replace(score, trunk=manner.led(score.trunk))
    feet = {side: foot_path(score.feet[side], side, body, score.frames) for side in SIDES}
    asked, still = _plan(score, body, manner, feet), np.zeros(score.frames)
    state = _State(np.zeros((score.frames, 2)), still, still, still)
    pose = _pose(score, body, manner, asked, state)
    for _ in range(_passes(score, body) - 1):
        state = _adjusted(score, body, asked, state, pose)
        pose = _pose(score, body, manner, asked, state)
    return pose.solution(*labels(feet))


def _passes(score: Score, body: Body) -> int:
    """Number of passes."""
    if hands.reaches_down(score, body) or hands.any_planted(score):
        return 8
    touching = any(hand.touches for hand in score.hands.values())
    return 4 if touching or score.balance.any() or score.flights else 1


@dataclass(frozen=True, eq=False)
class _State:
    """What a pass hands to the next: the pelvis' shift ``(frames, 2)`` for balance, metres, the trunk's
    additional lean ``(frames,)``, radians, how far the hips sink for a hand that is to reach down
    ``(frames,)``, metres, how far the pelvis is off its height ``(frames,)``, metres, for the centre of
    mass to fall freely, where the centre of mass was before any shift, and how much the hips sink
    ``(frames,)``, metres, for hands that are planted on the floor."""

    shift: np.ndarray
    lean: np.ndarray
    low: np.ndarray
    thrown: np.ndarray
    unbalanced: np.ndarray | None = None
    crouch: np.ndarray | float = 0.0


@dataclass(frozen=True, eq=False)
class _Plan:
    """The demands of a score on a body, computed once for all passes.

    pelvis, head: ``(frames, 3, 3)`` orientations. middle: ``(frames, 3)`` metres, between the hip joints.
    root: ``(frames, 3)`` from there to the root; hips: ``(2, frames, 3)`` to either hip joint. ankles:
    ``(2, frames, 3)`` on the floor's paths; free: ``(2, frames)`` how much higher than these allow the
    pelvis may go. knees: ``(2, frames, 3)`` where they rest, or None where none kneels. swivel:
    ``(2, frames)`` of the knees; pole: where they rest and how far they do ``(2, frames)``, or None.
    support: ``(2, frames, 1)`` shares of the feet in what the balance is over; along: ``(2, frames, 1)``
    where that is on their soles, from ankle (0) to toe joint (1).
    """

    pelvis: np.ndarray
    head: np.ndarray
    middle: np.ndarray
    root: np.ndarray
    hips: np.ndarray
    ankles: np.ndarray
    free: np.ndarray
    knees: np.ndarray | None
    feet: Mapping[str, FootPath]
    swivel: np.ndarray
    pole: tuple[np.ndarray, np.ndarray] | None
    hands: Mapping[str, HandPlan]
    support: np.ndarray
    along: np.ndarray


def _plan(score: Score, body: Body, manner: Manner, feet: Mapping[str, FootPath]) -> _Plan:
    trunk = score.trunk
    lean = trunk.pelvis[:, 1]
    if score.prone is not None:
        lean = lean + score.prone * kneeling.all_fours(body)[0]
    facing = score.heading + trunk.pelvis[:, 0]
    pelvis = about(1, facing) @ about(0, lean) @ about(2, -trunk.pelvis[:, 2])
    hips = np.stack([rotated(pelvis, body.reach(f"{side}_up_leg", "hips")) for side in SIDES])
    from_root = 0.5 * (hips[0] + hips[1])
    follow = trunk.follow * (trunk.pelvis[:, 0] + trunk.chest[:, 0])
    head = about(1, score.heading + trunk.gaze[:, 0] + follow)
    swivel = [air_swivel(score, side, manner.knees * (facing - feet[side].yaw)) for side in SIDES]
    resting, pole = kneeling.knees(score, feet, body), None
    if resting is not None:
        # a foot that is carried somewhere has its own way of turning the knee
        kneels = [kneeling.kneels(score, side) * (score.feet[side].air is None) for side in SIDES]
        pole = (resting, np.stack(kneels))
    # the middle of the sole; the toes where the heel is off the floor
    on_toes = smooth(np.stack([score.feet[side].heel for side in SIDES]) / 0.25)
    return _Plan(
        pelvis=pelvis,
        head=head @ about(0, trunk.gaze[:, 1]) @ about(2, -trunk.gaze[:, 2]),
        middle=pelvis_place(score, body),
        root=-from_root,
        hips=hips - from_root,
        ankles=np.stack([feet[side].ankle for side in SIDES]),
        free=np.stack([flight.unbound(score, side, feet[side], body) for side in SIDES]),
        knees=resting,
        feet=feet,
        swivel=np.stack(swivel),
        pole=pole,
        hands={side: hands.plan(score, side, body, manner.elbows) for side in SIDES},
        support=np.stack([score.support, 1.0 - score.support])[..., None],
        along=(0.4 + manner.ahead + (0.55 - manner.ahead) * on_toes)[..., None],
    )


def _pose(score: Score, body: Body, manner: Manner, asked: _Plan, state: _State) -> Pose:
    pose = Pose(body, score.frames)
    _set_pelvis(pose, score, asked, state)
    _set_spine(pose, score, asked, manner.lower_back, state)
    _set_legs(pose, score, asked)
    for sides in hands.order(score):
        hands.set_arms(pose, [asked.hands[side] for side in sides], manner.collar)
    return pose


def _adjusted(score: Score, body: Body, asked: _Plan, state: _State, pose: Pose) -> _State:
    """The next pass' shift and lean, from what this pass lacked."""
    positions = pose.positions.swapaxes(0, 1)
    centre = centre_of_mass(body, positions)[:, 0::2]
    ankle, toe = pose.both("foot")[..., 0::2], pose.both("toe")[..., 0::2]
    under = (asked.support * (ankle + asked.along * (toe - ankle))).sum(axis=0)
    under = flight.carried_over(score, under)
    free = centre if state.unbalanced is None else state.unbalanced
    shift = state.shift + free + score.balance[:, None] * (under - free) - centre
    lever = body.structure.lever * body.proportions.trunk
    missing = np.where(np.isfinite(pose.missing), pose.missing, 0.0)
    lean = -lower_envelope(-np.maximum(state.lean + 0.7 * missing / lever, 0.0), 4)
    # the less the spine bends further, the more the knees do
    share = 0.25 + 0.75 * np.tanh(state.lean / MOST_LEAN) ** 2
    low = -lower_envelope(-np.maximum(state.low + share * missing, 0.0), 4)
    crouch = state.crouch + hands.crouching(score, pose.short)
    return _State(shift, lean, low, flight.fall(score, body, positions), free, crouch)


def _set_pelvis(pose: Pose, score: Score, asked: _Plan, state: _State) -> None:
    body, leg = pose.body, pose.body.proportions.leg
    middle = asked.middle.copy()
    middle[:, 0::2] += state.shift
    middle[:, 1] -= _up_to(_MOST_LOW * leg, state.low) + hands.eased_crouch(state.crouch, body)
    limb = leg_limb(body)
    length = limb.exact * limb.longest
    flat = ((middle + asked.hips - asked.ankles)[..., 0::2] ** 2).sum(axis=-1)
    rise = np.sqrt(np.maximum(length * length - flat, 0.01 * length * length))
    caps = asked.ankles[..., 1] + rise - asked.hips[..., 1] + asked.free
    cap = lower_envelope(np.minimum(caps[0], caps[1]), 2)
    reached = soft_min(middle[:, 1], cap, 0.008 * leg)
    middle[:, 1] = flight.bridged(score, middle[:, 1], reached) + state.thrown
    middle[:, 1] = kneeling.over_floor(middle[:, 1], body)
    if asked.knees is not None:
        middle = kneeling.on_knees(score, middle, asked.hips, asked.knees, body)
    pose.positions[0] = middle + asked.root
    pose.set("hips", asked.pelvis)


def _set_spine(pose: Pose, score: Score, asked: _Plan, lower_back: float, state: _State) -> None:
    """lower_back: share of the bend moved from the upper to the lower spine."""
    bending, chest = pose.body.structure.bending, score.trunk.chest
    whole = np.stack([chest[:, 1] + _up_to(MOST_LEAN, state.lean), chest[:, 0], -chest[:, 2]], axis=-1)
    shares = np.array([share for _, share in bending])
    shares[0] += lower_back
    shares[-1] -= lower_back
    below = asked.pelvis
    for (part, _), turn in zip(bending, from_vector(shares[:, None, None] * whole), strict=True):
        below = below @ turn
        pose.set(part, below)
    upper = pose.of(pose.body.structure.chest)
    pose.set("neck", part_way(upper, asked.head, np.full(score.frames, 0.45)))
    pose.set("head", asked.head)


def _up_to(most: float, value: np.ndarray) -> np.ndarray:
    """Values that are asked for, eased below a limit."""
    return most * np.tanh(value / most)


def _set_legs(pose: Pose, score: Score, asked: _Plan) -> None:
    """Thighs, shanks, feet and toes."""
    body, hips, hip = pose.body, pose.of("hips"), pose.both("up_leg")
    limbs, feet = (leg_limb(body),) * 2, asked.feet
    goal = np.stack(
        [air_ankle(score, side, at, feet[side], body) for side, at in zip(SIDES, hip, strict=True)]
    )
    thigh, shank = bend_all(limbs, hip, goal, hips, asked.swivel, asked.pole)
    carried = [(k, side) for k, side in enumerate(SIDES) if score.feet[side].air is not None]
    for _ in range(2 if carried else 0):
        for k, side in carried:
            soles = air_sole(score, side, shank[k], feet[side], body)
            goal[k] = clear_of_floor(goal[k], *soles, feet[side], body)
        thigh, shank = bend_all(limbs, hip, goal, hips, asked.swivel, asked.pole)
    pose.set_both("up_leg", thigh)
    pose.set_both("leg", shank)
    for side, turn in zip(SIDES, shank, strict=True):
        sole, toes = air_sole(score, side, turn, feet[side], body)
        pose.set(f"{side}_foot", sole)
        pose.set(f"{side}_toe", toes)
