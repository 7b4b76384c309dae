"""Dogs that go where people go: the same speed in leg lengths a second, the same heading, the same kind.

For work on bipeds and quadrupeds, which have no pairs: what is matched is the path, not the movement.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...conventions import FPS, along
from ...randomness import Stream
from ..score import DogScore, Score
from .gaits import GALLOP, STANDING, TROT, WALK, Habit, Way, paced
from .resting import stood, turned

PARTNERS: Mapping[str, str] = {
    "stand": "dog_stand",
    **dict.fromkeys(("walk", "arc", "sneak", "march"), "dog_walk"),
    "jog": "trot",
    "run": "gallop",
}
"""A person's kind -> the dog's kind that answers to it."""

_GAITS = {gait.kind: gait for gait in (WALK, TROT, GALLOP)}


def speeds(score: Score) -> np.ndarray:
    """``(frames,)`` of the way forward along the heading, leg lengths a second."""
    return (np.gradient(score.path, axis=0) * along(score.heading)).sum(axis=-1) * FPS


def follow(stream: Stream, leader: Score) -> DogScore:
    """A dog that goes its leader's way in the gait that answers to it, or stands with it.

    leader: of a kind of ``PARTNERS``: these go forward.
    """
    kind, frames = PARTNERS[leader.kind], leader.frames
    if kind in _GAITS:
        forward = speeds(leader)
        moving = np.flatnonzero(forward > STANDING)
        first, last = int(moving[0]), int(moving[-1])
        over = (first if first else -frames, last if last < frames - 1 else 2 * frames)
        way = Way(leader.heading, leader.path, np.maximum(forward, 0.0), over)
        return paced(stream, _GAITS[kind], way, Habit.draw(stream))
    turning = np.flatnonzero(np.abs(np.diff(leader.heading)) > 1e-3)
    if not len(turning):
        return stood(stream, leader.heading)
    # who shuffles while standing still stands
    score = turned(stream, leader.heading, (int(turning[0]), int(turning[-1]) + 1))
    return replace(score, kind=kind)
