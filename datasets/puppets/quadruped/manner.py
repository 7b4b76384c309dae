"""A dog's own way of moving, and how it carries head and tail."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..curves import wander
from ..performances.style import seconds
from ..randomness import Stream


@dataclass(frozen=True)
class Habit:
    """bounce, lift, roll: of trunk, paws and soles, 1 is usual. loose: size of involuntary movement.
    stance: half widths. neck: carried lower by, radians. tail: carried higher by. wag: radians, and how
    often a second. fore: how much higher the shoulders are carried, shares of standing."""

    bounce: float
    lift: float
    roll: float
    loose: float
    stance: float
    neck: float
    tail: float
    wag: float
    wags: float
    fore: float

    @classmethod
    def draw(cls, stream: Stream) -> Habit:
        """A dog's habits: each time the same for a stream that belongs to somebody."""
        if stream.person:
            stream = Stream(stream.person)
        return cls(
            bounce=stream.uniform(0.7, 1.3),
            lift=stream.uniform(0.8, 1.25),
            roll=stream.uniform(0.85, 1.15),
            loose=stream.uniform(0.6, 1.4),
            stance=stream.uniform(0.70, 0.95),
            neck=stream.uniform(-0.15, 0.15),
            tail=stream.uniform(-0.2, 0.9),
            wag=stream.uniform(0.05, 0.45),
            wags=stream.uniform(1.2, 2.8),
            fore=stream.uniform(-0.05, 0.02),
        )


def head_and_tail(
    stream: Stream, frames: int, habit: Habit, phase: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """neck ``(frames,)``, gaze ``(frames, 3)`` and tail ``(frames, 4)``; the tail wags with the gait."""
    t = seconds(frames)
    turns = habit.wags * t + stream.uniform(0.0, 1.0) if phase is None else phase
    wag = habit.wag * np.sin(2.0 * np.pi * turns)
    late = habit.wag * np.sin(2.0 * np.pi * (turns - 0.15))
    raised = habit.tail + wander(stream, t, 0.06 * habit.loose)
    neck = habit.neck + wander(stream, t, 0.05 * habit.loose)
    look = [wander(stream, t, size * habit.loose, 0.1, 0.6) for size in (0.16, 0.06, 0.05)]
    gaze = np.stack(look, axis=-1)
    gaze[:, 1] += 0.3 * neck
    tail = np.stack([raised, wag, 1.15 * raised, wag + 0.6 * late], axis=-1)
    return neck, gaze, tail
