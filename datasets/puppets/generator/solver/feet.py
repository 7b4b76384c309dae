"""Feet: from a schedule of contacts to the path of an ankle that keeps them exactly, and paths in the air.

A foot is a rigid sole with a heel, a toe joint and toes. While it is planted it rests flat or pivots
about its toe joint; it lands on heel or toe. In a swing the point that touched last (the toe joint) hands
over to the point that will touch next, which makes take-off and landing smooth by construction.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..bodies.structures import Body
from ..curves import bump, hermite, smooth, soft_min
from ..matrices import about, length, part_way, rotated
from ..performances.score import Foot, FootContact, Score
from .scaling import KNEELING_PITCH, air_point, air_reach, foot_pitch, foot_place


@dataclass(frozen=True, eq=False)
class FootPath:
    """ankle: ``(frames, 3)`` metres. yaw: ``(frames,)``. sole, toes: ``(frames, 3, 3)`` world orientations.
    planted, pivoting: ``(frames, 2)`` bool, ankle and toe joint: rest since the frame before, or turn about
    a point of the sole that rests. swinging: ``(frames,)`` bool, nothing of the foot touches the floor.
    floor: ``(frames,)`` height of the floor under it, metres."""

    ankle: np.ndarray
    yaw: np.ndarray
    sole: np.ndarray
    toes: np.ndarray
    planted: np.ndarray
    pivoting: np.ndarray
    swinging: np.ndarray
    floor: np.ndarray


def _sole(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Toe joint and heel ``(2,)`` from the ankle, as (up, forward), metres."""
    p = body.proportions
    return np.array([p.ball_height - p.ankle, p.ball]), np.array([-p.ankle, -p.heel])


@lru_cache(maxsize=64)
def foot_path(foot: Foot, side: str, body: Body, frames: int) -> FootPath:
    """The path of one foot of a body through a score's contacts, kept for its other manner."""
    t, (toe, heel) = np.arange(frames, dtype=float), _sole(body)
    pitch, bent, yaw = np.zeros((3, frames))
    # the point that rests, or is handed over from one to the next, and where it is on the foot
    pivot, on_foot = np.zeros((frames, 3)), np.zeros((frames, 2))
    swinging = np.zeros(frames, dtype=bool)
    foot = _fitted(foot, body)
    # of the floor under the foot, leg lengths; in a swing the lower one of its two ends
    level = np.full(frames, foot.contacts[0].level)
    for contact, after in zip(foot.contacts, [*foot.contacts[1:], None], strict=True):
        stay = (t >= contact.strike) & (t <= contact.off)
        pitch[stay], on_heel = _stance_pitch(contact, t[stay])
        yaw[stay] = _yaw(contact, side)
        bent[stay] = np.where(on_heel, pitch[stay], 0.0)
        resting = _resting(contact, side, body)
        pivot[stay] = np.where(on_heel[:, None], resting[1], resting[0])
        on_foot[stay] = np.where(on_heel[:, None], heel, toe)
        if after is None:
            continue
        away = (t > contact.off) & (t < after.strike)
        swinging |= away
        level = np.where(t > contact.off, min(contact.level, after.level), level)
        level = np.where(t >= after.strike, after.level, level)
        share = (t[away] - contact.off) / (after.strike - contact.off)
        pitch[away] = _swing_pitch(contact, after, t[away])
        bent[away] = pitch[away] * smooth(share / 0.7)
        yaw[away] = _yaw(contact, side) + smooth(share) * (_yaw(after, side) - _yaw(contact, side))
        pivot[away], on_foot[away] = _swing_pivot(contact, after, side, body, share)
    lift = foot.heel
    if foot.kneel is not None:
        # while the knee goes down the heel goes first
        lift = lift + KNEELING_PITCH * (foot.kneel * (1.7 - 0.7 * foot.kneel))
    raised = (lift > 0.0)[:, None]
    pitch = pitch + lift
    # a raised heel turns about the toe, whichever point the sole rested on
    pivot = np.where(raised, pivot + _turned(toe - on_foot, np.zeros(frames), yaw), pivot)
    ankle = pivot - _turned(np.where(raised, toe, on_foot), pitch, yaw)
    if foot.drift is not None:
        ankle[:, 0::2] += body.proportions.leg * foot.drift
    floor = level * body.proportions.leg
    ankle[:, 1] += np.where(swinging, _clearing(ankle[:, 1] - floor, pitch, bent, body), 0.0)
    planted = _planted(foot, t)
    pivoting = _since_before(~swinging)[:, None] & ~planted
    turn = about(1, yaw)
    turns = (turn @ about(0, pitch), turn @ about(0, bent))
    return FootPath(ankle, yaw, *turns, planted, pivoting, swinging, floor)


def _fitted(foot: Foot, body: Body) -> Foot:
    """The foot's course with the angles that its body gives them."""
    share = foot_pitch(body)
    contacts = tuple(
        replace(contact, strike_pitch=share * contact.strike_pitch, off_pitch=share * contact.off_pitch)
        for contact in foot.contacts
    )
    return replace(foot, contacts=contacts, heel=share * foot.heel)


def _yaw(contact: FootContact, side: str) -> float:
    return contact.heading + (contact.toe_out if side == "left" else -contact.toe_out)


def _turned(point: np.ndarray, pitch: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """``(frames, 3)``: points ``(frames, 2)`` of the foot, seen from its ankle, in world axes."""
    (up, ahead), c, s = point.T, np.cos(pitch), np.sin(pitch)
    level = up * s + ahead * c
    return np.stack([level * np.sin(yaw), up * c - ahead * s, level * np.cos(yaw)], axis=-1)


def _rates(contact: FootContact) -> tuple[float, float]:
    """Speeds of the sole's pitch at first touch and when the toe leaves, radians per frame."""
    landing = -1.3 * contact.strike_pitch / max(contact.flat - contact.strike, 1)
    return landing, 2.1 * contact.off_pitch / max(contact.off - contact.lift, 1)


def _stance_pitch(contact: FootContact, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pitch while the foot is down, and whether it rests on the heel."""
    landing, leaving = _rates(contact)
    pitch = np.zeros_like(t)
    early, late = t < contact.flat, t > contact.lift
    if contact.flat > contact.strike:
        ends = (contact.strike, contact.flat)
        pitch[early] = hermite(t[early], ends, (contact.strike_pitch, 0.0), (landing, 0.0))
    if contact.off > contact.lift:
        pitch[late] = hermite(
            t[late], (contact.lift, contact.off), (0.0, contact.off_pitch), (0.0, leaving)
        )
    return pitch, early & (contact.strike_pitch < 0.0)


def _swing_pitch(contact: FootContact, after: FootContact, t: np.ndarray) -> np.ndarray:
    leaving, landing = _rates(contact)[1], _rates(after)[0]
    start = contact.off_pitch if contact.off > contact.lift else 0.0
    end = after.strike_pitch if after.flat > after.strike else 0.0
    return hermite(t, (contact.off, after.strike), (start, end), (leaving, landing))


def _resting(contact: FootContact, side: str, body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Positions ``(3,)`` of toe joint and heel of a planted foot on the floor."""
    (x, z), yaw, p = foot_place(contact, side, body), _yaw(contact, side), body.proportions
    ahead = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    under = np.array([x, contact.level * p.leg, z])
    return under + p.ball * ahead + [0.0, p.ball_height, 0.0], under - p.heel * ahead


def _glide(share: np.ndarray, ease: float) -> np.ndarray:
    """A curve from 0 to 1 at an even speed that is gained and lost, by cubics, within ``ease`` at both
    ends."""
    x = 0.5 - np.abs(share - 0.5)
    u = np.minimum(x / ease, 1.0)
    half = (ease * (u * u * u - 0.5 * u**4) + np.maximum(x - ease, 0.0)) / (1.0 - ease)
    return np.where(share < 0.5, half, 1.0 - half)


_EDGE = 1.6
"""How much sooner than its swing ends a foot is up a step, or later than it begins starts to go down."""


def _swing_pivot(
    contact: FootContact, after: FootContact, side: str, body: Body, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The point that is handed over from toe to heel (or toe), and where it is on the foot."""
    sole, lands = _sole(body), _resting(after, side, body)
    leaves, last = _resting(contact, side, body)[0], int(after.strike_pitch < 0.0)
    climb, way = (after.level - contact.level) * body.proportions.leg, share
    rise = 1.0 - smooth(_EDGE * (1.0 - share))
    # round the edge of a step: it goes forward late on its way up, soon on its way down
    if climb > 0.0:
        way, rise = share**1.8, smooth(_EDGE * share)
    elif climb < 0.0:
        way = 1.0 - (1.0 - share) ** 1.8
    w = way * way * (3.0 - 2.0 * way)
    w = w + contact.hurry * (_glide(way, 0.2) - w)
    place = leaves + w[:, None] * (lands[last] - leaves)
    place[:, 1] += climb * (rise - w)
    place[:, 1] += contact.lift_height * body.proportions.leg * bump(share)
    return place, sole[0] + w[:, None] * (sole[last] - sole[0])


def _clearing(ankle: np.ndarray, pitch: np.ndarray, bent: np.ndarray, body: Body) -> np.ndarray:
    """The least that a swinging foot must rise so that neither heel, ball nor toes go through the floor."""
    p, c, s = body.proportions, np.cos(pitch), np.sin(pitch)
    toe, heel = (ankle + up * c - ahead * s for up, ahead in _sole(body))
    ball = toe - p.ball_height
    tip = ball - p.toes * np.sin(bent)
    return lifted((heel, ball, tip), 0.1 * p.ball_height)


def lifted(heights: Iterable[np.ndarray], slack: float) -> np.ndarray:
    """The least that ``(frames,)`` points at ``heights`` over the floor must rise, smoothly, for none to be
    deeper than ``slack``."""
    deep = sum((np.maximum(-height, 0.0) ** 4 for height in heights), start=np.array(slack**4))
    return np.asarray(deep**0.25 - slack)


def _planted(foot: Foot, t: np.ndarray) -> np.ndarray:
    """``(frames, 2)`` frames in which ankle and toe joint rest, and already rested in the frame before.

    The ankle rests while the sole is flat, and while its heel is held at one height; not on the raised
    foot of a kneeling leg.
    """
    stays, on_toe = np.zeros((2, len(t)), dtype=bool)
    for contact in foot.contacts:
        toe_first = contact.strike_pitch >= 0.0
        stays |= (t >= contact.flat) & (t <= contact.lift)
        on_toe |= (t >= (contact.strike if toe_first else contact.flat)) & (t <= contact.off)
    held = np.concatenate([foot.heel[:1] == 0.0, foot.heel[1:] == foot.heel[:-1]])
    if foot.kneel is not None:
        held &= _since_before(foot.kneel == 0.0)
    return np.stack([_since_before(stays) & held, _since_before(on_toe)], axis=-1)


def _since_before(label: np.ndarray) -> np.ndarray:
    """True where a label is set in a frame and in the one before; the first frame has only itself."""
    return label & np.concatenate([label[:1], label[:-1]])


_STRETCHED = 0.972
"""Share of its length to which a leg stretches while its foot is thrown along with the body."""


def air_ankle(score: Score, side: str, hip: np.ndarray, foot: FootPath, body: Body) -> np.ndarray:
    """``(frames, 3)`` metres: where the ankle goes; the floor's path where the foot is not aloft."""
    air = score.feet[side].air
    if air is None:
        return foot.ankle
    yaw = about(1, score.heading + score.trunk.pelvis[:, 0])
    there = hip + rotated(yaw, air_reach(air, side, body))
    goal = foot.ankle + air.weight[:, None] * (there - foot.ankle)
    if not score.flights:
        return goal
    # drawn towards the hip where a swinging leg would have to be straight
    distance, limb = length(goal - hip), body.proportions.thigh + body.proportions.shank
    near = soft_min(distance, np.array(_STRETCHED * limb), 0.02 * limb)
    return hip + np.where(foot.swinging, near / distance, 1.0)[:, None] * (goal - hip)


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
