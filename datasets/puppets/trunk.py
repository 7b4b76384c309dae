"""The trunk in the solver: where the pelvis goes, how the spine bends, where the head looks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from . import anatomy, flight, handplants, kneeling
from .bodies import Body
from .curves import lower_envelope, soft_min
from .feet import FootPath
from .limbs import about, from_vector, part_way, rotated
from .posing import Pose, State
from .scaling import pelvis_place
from .score import SIDES, Score

MOST_LEAN = 0.35
"""How far the spine bends, radians, for hands that would not reach otherwise."""
_MOST_LOW = 0.4
"""How far the hips sink for them, leg lengths."""


@dataclass(frozen=True, eq=False)
class TrunkPlan:
    """What a score asks of a body's trunk, whatever the passes find.

    turned, head: ``(frames, 3, 3)`` of hips and head. middle: ``(frames, 3)`` metres, the place between
    the hip joints. root: ``(frames, 3)`` from there to the root; hips: ``(2, frames, 3)`` to either hip
    joint. ankles: ``(2, frames, 3)`` on the floor's paths; free: ``(2, frames)`` how much higher than
    these allow the pelvis may go. knees: ``(2, frames, 3)`` where they rest, or None where none kneels.
    """

    turned: np.ndarray
    head: np.ndarray
    middle: np.ndarray
    root: np.ndarray
    hips: np.ndarray
    ankles: np.ndarray
    free: np.ndarray
    knees: np.ndarray | None


def plan(score: Score, body: Body, feet: Mapping[str, FootPath]) -> TrunkPlan:
    trunk = score.trunk
    lean = trunk.pelvis[:, 1]
    if score.prone is not None:
        lean = lean + score.prone * kneeling.all_fours(body)[0]
    turned = about(1, score.heading + trunk.pelvis[:, 0]) @ about(0, lean) @ about(2, -trunk.pelvis[:, 2])
    hips = np.stack([rotated(turned, body.reach(f"{side}_up_leg", "hips")) for side in SIDES])
    from_root = 0.5 * (hips[0] + hips[1])
    follow = trunk.follow * (trunk.pelvis[:, 0] + trunk.chest[:, 0])
    head = about(1, score.heading + trunk.gaze[:, 0] + follow)
    head = head @ about(0, trunk.gaze[:, 1]) @ about(2, -trunk.gaze[:, 2])
    return TrunkPlan(
        turned,
        head,
        pelvis_place(score, body),
        -from_root,
        hips - from_root,
        np.stack([feet[side].ankle for side in SIDES]),
        np.stack([flight.unbound(score, side, feet[side], body) for side in SIDES]),
        kneeling.knees(score, feet, body),
    )


def set_pelvis(pose: Pose, score: Score, asked: TrunkPlan, state: State) -> None:
    body, leg = pose.body, pose.body.proportions.leg
    middle = asked.middle.copy()
    middle[:, 0::2] += state.shift
    middle[:, 1] -= _up_to(_MOST_LOW * leg, state.low) + handplants.eased(state.crouch, body)
    limb = anatomy.leg(body)
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
    pose.places[0] = middle + asked.root
    pose.set("hips", asked.turned)


def set_spine(pose: Pose, score: Score, asked: TrunkPlan, lower_back: float, state: State) -> None:
    """lower_back: share of the bend moved from the upper to the lower spine."""
    bending, chest = pose.body.structure.bending, score.trunk.chest
    whole = np.stack([chest[:, 1] + _up_to(MOST_LEAN, state.lean), chest[:, 0], -chest[:, 2]], axis=-1)
    shares = np.array([share for _, share in bending])
    shares[0] += lower_back
    shares[-1] -= lower_back
    below = asked.turned
    for (part, _), turn in zip(bending, from_vector(shares[:, None, None] * whole), strict=True):
        below = below @ turn
        pose.set(part, below)
    upper = pose.of(pose.body.structure.chest)
    pose.set("neck", part_way(upper, asked.head, np.full(score.frames, 0.45)))
    pose.set("head", asked.head)


def _up_to(most: float, value: np.ndarray) -> np.ndarray:
    """Values that are asked for, eased below a limit."""
    return most * np.tanh(value / most)
