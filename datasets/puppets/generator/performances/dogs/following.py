"""Dogs that go where people go: the same speed in leg lengths a second, the same heading, the same kind.

For work on bipeds and quadrupeds, which have no pairs: what is matched is the path, not the movement.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...conventions import FPS, along
from ...randomness import Stream
from ..score import DogScore, Score
from .gaits import GALLOP, STANDING, TROT, WALK, Gait, Habit, Way, paced
from .resting import stood, turned

PARTNERS: Mapping[str, str] = {
    "stand": "dog_stand",
    "turn": "dog_turn",
    **dict.fromkeys(("walk", "arc", "sneak", "march", "limp"), "dog_walk"),
    "jog": "trot",
    "run": "gallop",
}
"""A person's kind -> the dog's kind that answers to it."""

_GAITS = {gait.kind: gait for gait in (WALK, TROT, GALLOP)}


def speeds(score: Score) -> np.ndarray:
    """``(frames,)`` of the way forward along the heading, leg lengths a second."""
    return (np.gradient(score.path, axis=0) * along(score.heading)).sum(axis=-1) * FPS


def follow(stream: Stream, leader: Score) -> DogScore | None:
    """A dog that goes its leader's way in the gait that answers to it, or stands or turns with it.

    None where the leader does anything else, or goes backwards or sideways.
    """
    kind = PARTNERS.get(leader.kind)
    if kind in _GAITS:
        return _going(stream, leader, _GAITS[kind])
    moving = np.flatnonzero(np.abs(np.diff(leader.heading)) > 1e-3)
    if kind == "dog_stand" and not len(moving):
        return stood(stream, leader.heading)
    if kind is None or not len(moving):
        return None
    # who shuffles while standing still stands
    score = turned(stream, leader.heading, (int(moving[0]), int(moving[-1]) + 1))
    return replace(score, kind=kind)


def _going(stream: Stream, leader: Score, gait: Gait) -> DogScore | None:
    forward, frames = speeds(leader), leader.frames
    flat = (np.gradient(leader.path, axis=0) ** 2).sum(axis=-1) * FPS**2
    moving = np.flatnonzero(forward > STANDING)
    if not len(moving) or forward.min() < -STANDING or (flat - forward**2).max() > STANDING**2:
        return None
    first, last = int(moving[0]), int(moving[-1])
    over = (first if first else -frames, last if last < frames - 1 else 2 * frames)
    way = Way(leader.heading, leader.path, np.maximum(forward, 0.0), over)
    return paced(stream, gait, way, Habit.draw(stream))
