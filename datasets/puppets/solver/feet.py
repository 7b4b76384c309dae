"""Feet: from a schedule of plants to the path of an ankle, with exact contacts, and paths through the air.

A foot is a rigid sole with a heel, a toe joint and toes. While it is planted it rests flat or pivots
about its toe joint; it lands on heel or toe. In a swing the point that touched last (the toe joint) hands
over to the point that will touch next, which makes take-off and landing smooth by construction.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..bodies.structures import Body
from ..conventions import SIDES, sign
from ..curves import bump, hermite, smooth, soft_min
from ..matrices import about, part_way
from ..performances.score import Foot, Plant, Score
from .scaling import KNEELING_PITCH, air_point, air_reach, foot_pitch, foot_place


@dataclass(frozen=True, eq=False)
class FootPath:
    """ankle: ``(frames, 3)`` metres. yaw: ``(frames,)``. sole, toes: ``(frames, 3, 3)`` world orientations.
    flat, on_toe: ``(frames,)`` bool, whether ankle and toe joint rest since the frame before.
    swinging: ``(frames,)`` bool, whether nothing of the foot touches the floor. floor: ``(frames,)`` height
    of the floor under it, metres."""

    ankle: np.ndarray
    yaw: np.ndarray
    sole: np.ndarray
    toes: np.ndarray
    flat: np.ndarray
    on_toe: np.ndarray
    swinging: np.ndarray
    floor: np.ndarray


@dataclass(frozen=True, eq=False)
class _Sole:
    """Points of a foot from its ankle, as (up, forward), metres."""

    toe: tuple[float, float]
    heel: tuple[float, float]
    ball_height: float
    toes: float

    @classmethod
    def of(cls, body: Body) -> _Sole:
        p = body.proportions
        return cls((p.ball_height - p.ankle, p.ball), (-p.ankle, -p.heel), p.ball_height, p.toes)


@lru_cache(maxsize=64)
def foot_path(foot: Foot, side: str, body: Body, frames: int) -> FootPath:
    """The path of one foot of a body through a score's plants, kept for its other manner."""
    t = np.arange(frames, dtype=float)
    sole = _Sole.of(body)
    pitch, bent, yaw = np.zeros(frames), np.zeros(frames), np.zeros(frames)
    pivot, up, ahead = np.zeros((frames, 3)), np.zeros(frames), np.zeros(frames)
    swinging = np.zeros(frames, dtype=bool)
    foot = _fitted(foot, body)
    for plant, after in zip(foot.plants, [*foot.plants[1:], None], strict=True):
        last = after.strike if after else frames
        stay = (t >= plant.strike) & (t <= plant.off)
        pitch[stay], on_heel = _stance_pitch(plant, t[stay])
        yaw[stay] = _yaw(plant, side)
        bent[stay] = np.where(on_heel, pitch[stay], 0.0)
        point, (up[stay], ahead[stay]) = _stance_pivot(plant, side, body, sole, on_heel)
        pivot[stay] = point
        if after is None:
            continue
        away = (t > plant.off) & (t < last)
        swinging |= away
        share = (t[away] - plant.off) / (after.strike - plant.off)
        pitch[away] = _swing_pitch(plant, after, t[away])
        bent[away] = pitch[away] * smooth(share / 0.7)
        yaw[away] = _yaw(plant, side) + smooth(share) * (_yaw(after, side) - _yaw(plant, side))
        pivot[away], up[away], ahead[away] = _swing_pivot(plant, after, side, body, sole, share)
    heel = foot.heel if foot.kneel is None else foot.heel + KNEELING_PITCH * risen(foot.kneel)
    raised = heel > 0.0
    pitch = pitch + heel
    # a raised heel turns about the toe, whichever point the sole rested on
    toe_place = foot_toe(pivot, up, ahead, yaw, sole)
    pivot = np.where(raised[:, None], toe_place, pivot)
    up, ahead = np.where(raised, sole.toe[0], up), np.where(raised, sole.toe[1], ahead)
    ankle = pivot - _turned(up, ahead, pitch, yaw)
    floor = _floor(foot, t) * body.proportions.leg
    ankle[:, 1] += np.where(swinging, _clearing(ankle[:, 1] - floor, pitch, bent, sole), 0.0)
    flat, on_toe = _contacts(foot, t)
    turn = about(1, yaw)
    turns = (turn @ about(0, pitch), turn @ about(0, bent))
    return FootPath(ankle, yaw, *turns, flat, on_toe, swinging, floor)


def risen(kneel: np.ndarray) -> np.ndarray:
    """Share of its pitch that a foot has while its knee goes down: the heel goes first."""
    return kneel * (1.7 - 0.7 * kneel)


def _floor(foot: Foot, t: np.ndarray) -> np.ndarray:
    """Level under the foot ``(frames,)``, leg lengths; in a swing the lower one of its two ends."""
    level = np.full(len(t), foot.plants[0].level)
    for plant, after in zip(foot.plants[:-1], foot.plants[1:], strict=True):
        level = np.where(t > plant.off, min(plant.level, after.level), level)
        level = np.where(t >= after.strike, after.level, level)
    return level


def _fitted(foot: Foot, body: Body) -> Foot:
    """The foot's course with the angles that its body gives them."""
    share = foot_pitch(body)
    plants = tuple(
        replace(plant, strike_pitch=share * plant.strike_pitch, off_pitch=share * plant.off_pitch)
        for plant in foot.plants
    )
    return replace(foot, plants=plants, heel=share * foot.heel)


def foot_toe(
    pivot: np.ndarray, up: np.ndarray, ahead: np.ndarray, yaw: np.ndarray, sole: _Sole
) -> np.ndarray:
    """Positions of the toe joint while the sole is flat."""
    flat = np.zeros_like(yaw)
    return pivot + _turned(sole.toe[0] - up, sole.toe[1] - ahead, flat, yaw)


def _yaw(plant: Plant, side: str) -> float:
    return plant.heading + (plant.toe_out if side == "left" else -plant.toe_out)


def _turned(up: np.ndarray, ahead: np.ndarray, pitch: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """``(frames, 3)``: points of the foot, seen from its ankle, in world axes."""
    c, s = np.cos(pitch), np.sin(pitch)
    level = up * s + ahead * c
    return np.stack([level * np.sin(yaw), up * c - ahead * s, level * np.cos(yaw)], axis=-1)


def _rates(plant: Plant) -> tuple[float, float]:
    """Speeds of the sole's pitch at first touch and when the toe leaves, radians per frame."""
    landing = -1.3 * plant.strike_pitch / max(plant.flat - plant.strike, 1)
    return landing, 2.1 * plant.off_pitch / max(plant.off - plant.lift, 1)


def _stance_pitch(plant: Plant, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pitch while the foot is down, and whether it rests on the heel."""
    landing, leaving = _rates(plant)
    pitch = np.zeros_like(t)
    early, late = t < plant.flat, t > plant.lift
    if plant.flat > plant.strike:
        ends = (plant.strike, plant.flat)
        pitch[early] = hermite(t[early], ends, (plant.strike_pitch, 0.0), (landing, 0.0))
    if plant.off > plant.lift:
        pitch[late] = hermite(t[late], (plant.lift, plant.off), (0.0, plant.off_pitch), (0.0, leaving))
    return pitch, early & (plant.strike_pitch < 0.0)


def _swing_pitch(plant: Plant, after: Plant, t: np.ndarray) -> np.ndarray:
    leaving, landing = _rates(plant)[1], _rates(after)[0]
    start = plant.off_pitch if plant.off > plant.lift else 0.0
    end = after.strike_pitch if after.flat > after.strike else 0.0
    return hermite(t, (plant.off, after.strike), (start, end), (leaving, landing))


def _stance_pivot(
    plant: Plant, side: str, body: Body, sole: _Sole, on_heel: np.ndarray
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """The resting point per frame, and where it is on the foot."""
    heel, toe = _resting(plant, side, body, sole)
    place = np.where(on_heel[:, None], heel, toe)
    up = np.where(on_heel, sole.heel[0], sole.toe[0])
    return place, (up, np.where(on_heel, sole.heel[1], sole.toe[1]))


def _resting(plant: Plant, side: str, body: Body, sole: _Sole) -> tuple[np.ndarray, np.ndarray]:
    """Positions of heel and toe joint of a planted foot on the floor."""
    x, z = foot_place(plant, side, body)
    ahead = np.array([np.sin(_yaw(plant, side)), 0.0, np.cos(_yaw(plant, side))])
    under = np.array([x, plant.level * body.proportions.leg, z])
    return under + sole.heel[1] * ahead, under + sole.toe[1] * ahead + [0.0, sole.ball_height, 0.0]


def _glide(share: np.ndarray, ease: float) -> np.ndarray:
    """A curve from 0 to 1 at an even speed that is gained and lost, by cubics, within ``ease`` at both
    ends."""
    x = 0.5 - np.abs(share - 0.5)
    u = np.minimum(x / ease, 1.0)
    half = (ease * (u * u * u - 0.5 * u**4) + np.maximum(x - ease, 0.0)) / (1.0 - ease)
    return np.where(share < 0.5, half, 1.0 - half)


_EDGE = 1.6
"""How much sooner than its swing ends a foot is up a step, or later than it begins starts to go down."""


def _round_the_edge(share: np.ndarray, climb: float) -> np.ndarray:
    """The share of a swing's time by which a foot goes forward: late up a step, soon down one."""
    if climb > 0.0:
        return share**1.8
    return 1.0 - (1.0 - share) ** 1.8 if climb < 0.0 else share


def _swing_pivot(
    plant: Plant, after: Plant, side: str, body: Body, sole: _Sole, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The point that is handed over from toe to heel (or toe), and where it is on the foot."""
    _, leaves = _resting(plant, side, body, sole)
    heel, toe = _resting(after, side, body, sole)
    on_heel = after.strike_pitch < 0.0
    lands, point = (heel, sole.heel) if on_heel else (toe, sole.toe)
    climb = (after.level - plant.level) * body.proportions.leg
    way = _round_the_edge(share, climb)
    w = way * way * (3.0 - 2.0 * way)
    w = w + plant.hurry * (_glide(way, 0.2) - w)
    place = leaves + w[:, None] * (lands - leaves)
    risen = smooth(_EDGE * share) if climb > 0.0 else 1.0 - smooth(_EDGE * (1.0 - share))
    place[:, 1] += climb * (risen - w)
    place[:, 1] += plant.lift_height * body.proportions.leg * bump(share)
    return place, sole.toe[0] + w * (point[0] - sole.toe[0]), sole.toe[1] + w * (point[1] - sole.toe[1])


def _clearing(ankle: np.ndarray, pitch: np.ndarray, bent: np.ndarray, sole: _Sole) -> np.ndarray:
    """How much a swinging foot must rise so that neither heel, ball nor toes go through the floor."""
    c, s = np.cos(pitch), np.sin(pitch)
    toe = ankle + sole.toe[0] * c - sole.toe[1] * s
    heel = ankle + sole.heel[0] * c - sole.heel[1] * s
    ball = toe - sole.ball_height
    tip = ball - sole.toes * np.sin(bent)
    return lifted((heel, ball, tip), 0.1 * sole.ball_height)


def lifted(heights: Iterable[np.ndarray], slack: float) -> np.ndarray:
    """How much ``(frames,)`` points at ``heights`` over the floor must rise, smoothly, for none to be
    deeper than ``slack``."""
    deep = sum((np.maximum(-height, 0.0) ** 4 for height in heights), start=np.array(slack**4))
    return np.asarray(deep**0.25 - slack)


def _contacts(foot: Foot, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frames in which ankle and toe joint rest, and already rested in the frame before.

    The ankle rests while the sole is flat, and while its heel is held at one height; not on the raised
    foot of a kneeling leg.
    """
    stays, on_toe = np.zeros(len(t), dtype=bool), np.zeros(len(t), dtype=bool)
    for plant in foot.plants:
        toe_first = plant.strike_pitch >= 0.0
        stays |= (t >= plant.flat) & (t <= plant.lift)
        on_toe |= (t >= (plant.strike if toe_first else plant.flat)) & (t <= plant.off)
    held = np.concatenate([foot.heel[:1] == 0.0, foot.heel[1:] == foot.heel[:-1]])
    if foot.kneel is not None:
        held &= _since_before(foot.kneel == 0.0)
    return _since_before(stays) & held, _since_before(on_toe)


def _since_before(label: np.ndarray) -> np.ndarray:
    """Where a label is set in a frame and in the one before; the first frame has only itself."""
    return label & np.concatenate([label[:1], label[:-1]])


def labels(feet: Mapping[str, FootPath]) -> tuple[np.ndarray, np.ndarray]:
    """``(frames, 4)`` each, of ankle and toe joint, left and right: which rest, and which turn about a
    point of the sole that rests."""
    planted = np.stack([row for side in SIDES for row in (feet[side].flat, feet[side].on_toe)], axis=-1)
    down = np.stack([_since_before(~feet[side].swinging) for side in SIDES for _ in range(2)], axis=-1)
    return planted, down & ~planted


def air_ankle(score: Score, side: str, hip: np.ndarray, foot: FootPath, body: Body) -> np.ndarray:
    """``(frames, 3)`` metres: where the ankle goes; the floor's path where the foot is not aloft."""
    air = score.feet[side].air
    if air is None:
        return foot.ankle
    reach = air_reach(air, side, body)
    yaw = about(1, score.heading + score.trunk.pelvis[:, 0])
    there = hip + (yaw @ reach[..., None])[..., 0]
    goal = foot.ankle + air.weight[:, None] * (there - foot.ankle)
    return _slack_leg(hip, goal, foot, body) if score.flights else goal


_STRETCHED = 0.972
"""Share of its length to which a leg stretches while its foot is thrown along with the body."""


def _slack_leg(hip: np.ndarray, goal: np.ndarray, foot: FootPath, body: Body) -> np.ndarray:
    """The goal ``(frames, 3)``, drawn towards the hip where a swinging leg would have to be straight."""
    line = goal - hip
    distance = np.sqrt((line * line).sum(axis=-1))
    limb = body.proportions.thigh + body.proportions.shank
    most = np.full_like(distance, _STRETCHED * limb)
    share = np.where(foot.swinging, soft_min(distance, most, 0.02 * limb) / distance, 1.0)
    return hip + share[:, None] * line


def air_swivel(score: Score, side: str, grounded: np.ndarray) -> np.ndarray:
    """``(frames,)`` how the knee is turned about the line from hip to ankle."""
    air = score.feet[side].air
    if air is None:
        return grounded
    return grounded + air.weight * (sign(side) * air.swivel - grounded)


def air_sole(
    score: Score, side: str, shank: np.ndarray, foot: FootPath, body: Body
) -> tuple[np.ndarray, np.ndarray]:
    """Orientations ``(frames, 3, 3)`` of foot and toes: with the shin where aloft."""
    air = score.feet[side].air
    if air is None:
        return foot.sole, foot.toes
    pointed = shank @ about(0, air_point(air, body))
    # the ankle gives way early, so that it is not bent by a shin that already hangs from a raised knee
    share = 1.0 - (1.0 - air.weight) ** 2
    return part_way(foot.sole, pointed, share), part_way(foot.toes, pointed, share)


def clear_of_floor(
    ankle: np.ndarray, sole: np.ndarray, toes: np.ndarray, foot: FootPath, body: Body
) -> np.ndarray:
    """The ankle's positions ``(frames, 3)``, higher where such a foot would be in the floor."""
    p = body.proportions
    ball = ankle + sole @ np.array([0.0, p.ball_height - p.ankle, p.ball])
    points = (
        ankle + sole @ np.array([0.0, -p.ankle, -p.heel]),
        ball - np.array([0.0, p.ball_height, 0.0]),
        ball + toes @ np.array([0.0, -p.ball_height, p.toes]),
    )
    up = lifted([point[:, 1] - foot.floor for point in points], 0.1 * p.ball_height)
    return ankle + up[:, None] * np.array([0.0, 1.0, 0.0])
