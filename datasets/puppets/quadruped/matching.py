"""Dogs that go where people go: the same speed in leg lengths a second, the same heading, the same kind.

For work on bipeds and quadrupeds, which have no pairs: what is matched is the way, not the movement. The
two motions of a match form no case.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..randomness import Stream
from ..score import FPS, Score
from .gaits import GALLOP, TROT, WALK, Way, paced
from .manner import Habit
from .resting import turned
from .score import DogScore

PARTNERS: Mapping[str, tuple[str, ...]] = {
    "stand": ("dog_stand",),
    "turn": ("dog_turn",),
    **dict.fromkeys(("walk", "arc", "sneak", "march", "limp"), ("dog_walk",)),
    **dict.fromkeys(("jog", "run"), ("dog_walk", "trot", "gallop")),
    **dict.fromkeys(("sit", "sit_down"), ("dog_sit",)),
}
"""A person's kind -> a dog's kinds that answer to it; of several the one whose speed it is."""

_BOUNDS = ((2.5, WALK, "dog_walk"), (5.4, TROT, "trot"), (np.inf, GALLOP, "gallop"))
"""Gaits with the leg lengths a second up to which they are gone."""
_STEADY = 0.12
"""How far speed may stray from its mean, as a share of it: gaits keep their period."""


def speeds(score: Score) -> np.ndarray:
    """``(frames - 1,)`` of the way forward along the heading, leg lengths a second."""
    ahead = np.stack([np.sin(score.heading), np.cos(score.heading)], axis=-1)
    return (np.diff(score.path, axis=0) * (ahead[1:] + ahead[:-1])).sum(axis=-1) * 0.5 * FPS


def follow(stream: Stream, leader: Score) -> DogScore | None:
    """A dog that goes its leader's way in a gait of that speed, or turns with it on the spot.

    None where the leader neither goes forward at an even speed nor turns on the spot.
    """
    forward = speeds(leader)
    speed = float(forward.mean())
    if float(np.abs(np.diff(leader.path, axis=0)).max()) < 1e-3:
        return _turning(stream, leader.heading)
    if speed < 0.3 or np.abs(forward - speed).max() > _STEADY * speed:
        return None
    gait, kind = next((gait, kind) for most, gait, kind in _BOUNDS if speed <= most)
    turning = float(leader.heading[-1] - leader.heading[0]) * FPS / max(leader.frames - 1, 1)
    way = Way(leader.heading, leader.path, speed, turning)
    return paced(stream, leader.frames, gait, kind, way, Habit.draw(stream))


def _turning(stream: Stream, heading: np.ndarray) -> DogScore | None:
    moving = np.flatnonzero(np.abs(np.diff(heading)) > 1e-3)
    if len(moving) < 10:
        return None
    return turned(stream, heading, (int(moving[0]), int(moving[-1]) + 1))
