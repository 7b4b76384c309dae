"""Arms that go from one shape to the next: what gestures, blows and dances are made of."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...conventions import other
from ...curves import bump, ramp
from ..score import Hand, Touch
from .style import Performer, rows

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Shape:
    """An arm in one moment, in the words of ``score.Hand``; touch: a place, or nothing; palm,
    fingers: where they point (out, up, forward), or nothing."""

    reach: Triple
    wrist: Triple = (0.0, 0.0, 0.0)
    swivel: float = 0.0
    upright: float = 0.5
    middle: float = 0.0
    touch: str = ""
    palm: Triple | None = None
    fingers: Triple = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Move:
    """Going to a shape between two frames, or to hanging at ease. arc: how far the way bows out of the
    straight one, arm lengths. A hand touches in full from ``end`` to the next move's ``start``."""

    start: float
    end: float
    to: Shape | None = None
    arc: Triple = (0.0, 0.0, 0.0)


def moving(person: Performer, moves: Sequence[Move]) -> Hand:
    """An arm at ease that makes the moves in order."""
    frames, k = person.frames, np.arange(person.frames, dtype=float)
    hang = person.hang(0.035, 0.02, 0.05)
    ease = rows(frames, 0.18 + person.wander(0.08), 0.0, person.wander(0.08))
    small = rows(frames, *(person.wander(0.009) for _ in range(3)))
    reach, wrist, touches = hang, ease, dict[str, np.ndarray]()
    held = rest = rows(frames, 0.0, 0.7, 0.0)
    aim, aimed = np.tile([0.0, -1.0, 0.0, 0.0, 0.0, 1.0], (frames, 1)), np.zeros(frames)
    for move in moves:
        s = ramp(k, move.start, move.end)[:, None]
        to, long = move.to, move.end - move.start
        there = hang if to is None else np.array(to.reach) + small
        bow = bump((k - move.start) / long)[:, None] * np.array(move.arc)
        reach = (1.0 - s) * reach + s * there + bow
        wrist = (1.0 - s) * wrist + s * (ease if to is None else 0.5 * ease + np.array(to.wrist))
        held = (1.0 - s) * held + s * (rest if to is None else np.array([to.swivel, to.upright, to.middle]))
        touches = _touching(touches, k, move)
        aim, aimed = _aiming(aim, aimed, s[:, 0], to)
    return Hand(
        reach=reach,
        upright=held[:, 1],
        middle=held[:, 2],
        swivel=held[:, 0],
        wrist=wrist,
        touches=tuple(Touch(place, weight) for place, weight in touches.items()),
        aim=aim,
        aimed=aimed,
    )


def _aiming(
    aim: np.ndarray, aimed: np.ndarray, s: np.ndarray, to: Shape | None
) -> tuple[np.ndarray, np.ndarray]:
    """Palm and fingers turn to where the shape wants them, or are let go."""
    if to is None or to.palm is None:
        return aim, (1.0 - s) * aimed
    before = (1.0 - s) * aimed
    share = np.where(before + s > 0.0, s / np.maximum(before + s, 1e-9), 1.0)[:, None]
    return aim + share * (np.array([*to.palm, *to.fingers]) - aim), before + s


def _touching(touches: dict[str, np.ndarray], k: np.ndarray, move: Move) -> dict[str, np.ndarray]:
    """The hand leaves its place in the first part of a move and settles on the next one in the last."""
    place, long = move.to.touch if move.to else "", move.end - move.start
    leaving = 1.0 - ramp(k, move.start, move.start + 0.6 * long)
    after = {name: weight if name == place else weight * leaving for name, weight in touches.items()}
    if place:
        before = after.get(place, np.zeros(len(k)))
        settling = ramp(k, move.start + 0.35 * long, move.end)
        after[place] = np.where(settling == 1.0, 1.0, before + (1.0 - before) * settling)
    return after


_ON = {
    "hip": Shape((0.30, -0.72, 0.02), swivel=0.6),
    "knee": Shape((0.05, -0.80, 0.45), swivel=0.3, upright=1.0),
    "toe": Shape((0.02, -0.88, 0.42), wrist=(0.1, 0.0, 0.3), upright=1.0),
    "head": Shape((-0.02, 0.30, 0.50), (0.0, 0.0, -0.6), swivel=0.35),
    "brow": Shape((0.05, 0.22, 0.52), (0.0, 0.0, -0.3), swivel=0.5),
    "belly": Shape((0.12, -0.66, 0.36), (0.1, 0.0, 0.5), swivel=0.25, middle=1.0),
}
_ON_OTHER = {
    "shoulder": Shape((-0.30, 0.02, 0.34), (0.2, 0.0, 0.0), swivel=0.15, middle=1.0),
    "upper_arm": Shape((-0.32, -0.32, 0.40), (0.2, 0.0, 0.3), swivel=0.1, middle=1.0),
    "ribs": Shape((-0.16, -0.38, 0.34), (0.1, 0.0, 0.5), swivel=0.1, middle=1.0),
}
"""Shapes near points of the body, from which a hand settles there: of its own side, of the other one."""


def on(point: str, side: str) -> Shape:
    """An arm with its hand on the hip, knee ... of its side, or on the shoulder ... of the other one."""
    if point in _ON:
        return replace(_ON[point], touch=f"{side}_{point}")
    return replace(_ON_OTHER[point], touch=f"{other(side)}_{point}")
