"""Where a foot stands: one place for every stretch of time in which the source's foot is planted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from retarget_bench.methods.ik.ease import smoothstep, spread
from retarget_bench.methods.ik.rig import Rig
from retarget_bench.methods.ik.two_bone import Limb, Pose
from retarget_bench.motion import contact, rotation
from retarget_bench.motion.motion import Motion

_GAP, _SHORTEST = 2 / 30, 2 / 30
"""Seconds: breaks in a contact that are closed, contacts that are too short to count."""
_ON_FLOOR, _IN_AIR = 0.06, 0.15
"""Body heights above its rest height: up to where a planted joint stands on the floor, from where it hangs."""


@dataclass(frozen=True)
class Exchange:
    """A motion on its way from one body to another: what was done, and what was copied of it."""

    source: Motion
    theirs: Rig
    ours: Rig
    pose: Pose
    ratio: float


@dataclass(frozen=True)
class Plan:
    """What one limb shall do.

    goal: ``(frames, 3)`` where its end goes. orientation: ``(frames, 4)`` of the end in the world.
    firm: ``(frames,)`` bool, the frames in which it is planted and has to be reached.
    """

    goal: np.ndarray
    orientation: np.ndarray
    firm: np.ndarray


@dataclass(frozen=True)
class Point:
    """One contact joint: its copied path, the height it should have, and when the source plants it."""

    path: np.ndarray
    height: np.ndarray
    planted: np.ndarray


def plan(exchange: Exchange, theirs: Limb, ours: Limb) -> Plan:
    """Goals for a foot that hold ankle and toe wherever the source holds them.

    The foot's direction is corrected first (ankle and toe both planted: the mean direction), then its
    place, from whichever of the two is planted. Both corrections are eased over the other frames.
    """
    fps = exchange.source.fps
    ankle = point(exchange, theirs.end, ours.end)
    orientation = exchange.pose.turned[:, ours.end]
    if ours.tip < 0 or theirs.tip < 0:
        shift = spread(held(ankle) - ankle.path, ankle.planted, fps)
        return Plan(ankle.path + shift, orientation, ankle.planted)
    toe = point(exchange, theirs.tip, ours.tip)
    sole = toe.path - ankle.path
    at_ankle, at_toe = _held_pair(ankle, toe)
    both = ankle.planted & toe.planted
    turn = rotation.between(sole, np.where(both[:, None], at_toe - at_ankle, sole))
    turn = rotation.from_rotation_vector(spread(rotation.to_rotation_vector(turn), both, fps))
    wanted = np.where(toe.planted[:, None], at_toe - rotation.rotate(turn, sole), at_ankle)
    firm = ankle.planted | toe.planted
    shift = spread(wanted - ankle.path, firm, fps)
    return Plan(ankle.path + shift, rotation.multiply(turn, orientation), firm)


def point(exchange: Exchange, theirs: int, ours: int) -> Point:
    """A contact joint of the target, with the height that the source's stands above the floor, scaled.

    On the floor that is the target's own rest height plus what the source has beyond its own; in the air
    (lying, hanging) the copied height; between the two, a blend.
    """
    source = exchange.source
    path, seen, tall = exchange.pose.places[:, ours], source.positions[:, theirs], source.character.height
    above = seen[:, 1] - exchange.theirs.rest[theirs, 1]
    floor = exchange.ours.rest[ours, 1] + exchange.ratio * above
    air = smoothstep((np.abs(above) / tall - _ON_FLOOR) / (_IN_AIR - _ON_FLOOR))
    labels = contact.planted(seen[:, None], tall, source.fps)[:, 0]
    planted = contact.tidy(labels, round(_GAP * source.fps), round(_SHORTEST * source.fps))
    return Point(path, floor + air * (path[:, 1] - floor), planted)


def held(joint: Point) -> np.ndarray:
    """``(frames, 3)`` one place for every stretch in which the joint is planted, zeros elsewhere."""
    out = np.zeros_like(joint.path)
    for first, last in contact.runs(joint.planted).tolist():
        out[first:last] = _mean_place(joint, first, last)
    return out


def _mean_place(joint: Point, first: int, last: int) -> np.ndarray:
    """``(3,)`` the mean of the copied path over a stretch, at the height that the joint should have."""
    place = joint.path[first:last].mean(axis=0)
    place[1] = joint.height[first:last].mean()
    return place


def _held_pair(ankle: Point, toe: Point) -> tuple[np.ndarray, np.ndarray]:
    """``(frames, 3)`` each: where ankle and toe are held; meaningless where they are not planted.

    Stretches are settled from the longest to the shortest. One that overlaps a settled stretch of the
    other joint stands at the foot's mean direction from it; any other stands at its own mean place.
    """
    sole = toe.path - ankle.path
    length = np.linalg.norm(sole[0])
    points, places = (ankle, toe), (np.zeros_like(sole), np.zeros_like(sole))
    settled = np.zeros((2, len(sole)), dtype=bool)
    stretches = [(first, last, k) for k in (0, 1) for first, last in contact.runs(points[k].planted).tolist()]
    for first, last, k in sorted(stretches, key=lambda each: each[0] - each[1]):
        other = places[1 - k]
        shared = first + np.flatnonzero(settled[1 - k, first:last])
        if len(shared):
            shared = shared[(other[shared] == other[shared[0]]).all(axis=1)]
            mean = sole[shared].mean(axis=0)
            mean *= length / max(float(np.linalg.norm(mean)), 1e-9)
            place = other[shared[0]] + (mean if k == 1 else -mean)
        else:
            place = _mean_place(points[k], first, last)
        places[k][first:last] = place
        settled[k, first:last] = True
    return places
