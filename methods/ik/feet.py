"""Targets of planted feet: one position per stretch of time in which the source's foot is planted."""

from dataclasses import dataclass

import numpy as np

from retarget_bench.motion import contact, rotation
from retarget_bench.motion.motion import Motion

from .ease import smoothstep, spread
from .rig import Rig
from .two_bone import Limb, Pose

_GAP, _SHORTEST = 2 / 30, 2 / 30
"""Seconds: breaks in a contact that are closed, contacts that are too short to count."""
_ON_FLOOR, _IN_AIR = 0.06, 0.15
"""Body heights above its rest height: up to where a joint belongs to the floor, from where to the body."""


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
    """One contact joint: its path ``(frames, 3)``, and when the source plants it ``(frames,)``."""

    path: np.ndarray
    planted: np.ndarray


def plan(exchange: Exchange, theirs: Limb, ours: Limb) -> Plan:
    """Goals for a foot that hold ankle and toe wherever the source holds them.

    The foot's direction is corrected first (ankle and toe both planted: the mean direction), then its
    place, from whichever of the two is planted. Both corrections are eased over the other frames. Its
    height is told by the toe, which touches the floor; an ankle's depends on how the foot is turned.
    """
    fps = exchange.source.fps
    still = planted(exchange.source, theirs.end)
    orientation = exchange.pose.turned[:, ours.end]
    if ours.tip < 0 or theirs.tip < 0:
        path = walked(exchange, theirs.end, ours.end)
        shift = spread(held(Point(path, still)) - path, still, fps)
        return Plan(path + shift, orientation, still)
    sole = exchange.pose.places[:, ours.tip] - exchange.pose.places[:, ours.end]
    path = walked(exchange, theirs.end, ours.end)
    path[:, 1] = walked(exchange, theirs.tip, ours.tip)[:, 1] - sole[:, 1]
    ankle = Point(path, still)
    toe = Point(path + sole, planted(exchange.source, theirs.tip))
    at_ankle, at_toe = _held_pair(ankle, toe)
    both = ankle.planted & toe.planted
    turn = rotation.between(sole, np.where(both[:, None], at_toe - at_ankle, sole))
    turn = rotation.from_rotation_vector(spread(rotation.to_rotation_vector(turn), both, fps))
    wanted = np.where(toe.planted[:, None], at_toe - rotation.rotate(turn, sole), at_ankle)
    firm = ankle.planted | toe.planted
    shift = spread(wanted - path, firm, fps)
    return Plan(path + shift, rotation.multiply(turn, orientation), firm)


def walked(exchange: Exchange, theirs: int, ours: int) -> np.ndarray:
    """``(frames, 3)`` where a foot or hand goes that belongs to the floor, not to the body above it.

    Near the floor it is the source's own path, scaled like the root path, so that what stands still keeps
    standing still; to it comes what the two bodies differ by at rest (narrower hips, thicker soles), turned
    with the hips. Well above the floor (kicks, hanging, lying with raised legs) it is the copied path.
    """
    source, copied = exchange.source, exchange.pose.places[:, ours]
    seen, rest = source.positions[:, theirs], exchange.theirs.rest[theirs]
    differ = exchange.ours.rest[ours] - exchange.ratio * rest
    level = rotation.rotate(exchange.theirs.facing(source), differ * [1.0, 0.0, 1.0])
    scaled = exchange.ratio * seen + level * [1.0, 0.0, 1.0] + differ * [0.0, 1.0, 0.0]
    above = np.abs(seen[:, 1] - rest[1]) / source.character.height
    air = smoothstep((above - _ON_FLOOR) / (_IN_AIR - _ON_FLOOR))
    return scaled + air[:, None] * (copied - scaled)


def planted(source: Motion, joint: int) -> np.ndarray:
    """``(frames,)`` bool: the joint is held still, by its speed; specks of a frame or two do not count."""
    labels = contact.planted(source.positions[:, joint, None], source.character.height, source.fps)[:, 0]
    return contact.tidy(labels, round(_GAP * source.fps), round(_SHORTEST * source.fps))


def held(joint: Point) -> np.ndarray:
    """``(frames, 3)`` one place for every stretch in which the joint is planted, zeros elsewhere."""
    out = np.zeros_like(joint.path)
    for first, last in contact.runs(joint.planted).tolist():
        out[first:last] = joint.path[first:last].mean(axis=0)
    return out


def _held_pair(ankle: Point, toe: Point) -> tuple[np.ndarray, np.ndarray]:
    """``(frames, 3)`` each: where ankle and toe are held; meaningless where they are not planted.

    Stretches are settled from the longest to the shortest. One that overlaps a settled stretch of the
    other joint stands at the foot's mean direction from it; any other stands at its own mean place.
    """
    sole = toe.path - ankle.path
    length = np.linalg.norm(sole[0])
    points, places = (ankle, toe), (np.zeros_like(sole), np.zeros_like(sole))
    settled = np.zeros((2, len(sole)), dtype=bool)
    stretches = [
        (first, last, k) for k in (0, 1) for first, last in contact.runs(points[k].planted).tolist()
    ]
    for first, last, k in sorted(stretches, key=lambda each: each[0] - each[1]):
        other = places[1 - k]
        shared = first + np.flatnonzero(settled[1 - k, first:last])
        if len(shared):
            shared = shared[(other[shared] == other[shared[0]]).all(axis=1)]
            mean = sole[shared].mean(axis=0)
            mean *= length / max(float(np.linalg.norm(mean)), 1e-9)
            place = other[shared[0]] + (mean if k == 1 else -mean)
        else:
            place = points[k].path[first:last].mean(axis=0)
        places[k][first:last] = place
        settled[k, first:last] = True
    return places
