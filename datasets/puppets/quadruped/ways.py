"""Where a dog goes, and how fast: straight on, round an even arc or in gentle bends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..curves import plateau, wander
from ..performances.style import seconds
from ..randomness import Stream
from ..score import FPS

STANDING = 0.15
"""Leg lengths a second below which a dog stands rather than walks."""


@dataclass(frozen=True, eq=False)
class Way:
    """heading, speed: ``(frames,)``, leg lengths a second. path: ``(frames, 2)``, leg lengths. over: the
    frames between which it goes; beyond the clip at an end where it does not stand."""

    heading: np.ndarray
    path: np.ndarray
    speed: np.ndarray
    over: tuple[int, int]

    @property
    def turning(self) -> np.ndarray:
        """``(frames,)`` radians a second."""
        return np.gradient(self.heading) * FPS


def way(stream: Stream, frames: int, speed: float, most: float, there: bool = False) -> Way:
    """At most ``most`` radians a second of turning. there: from standing to standing."""
    t = seconds(frames)
    facing, turning = stream.uniform(-np.pi, np.pi), stream.uniform(-most, most)
    rate, start = stream.uniform(0.12, 0.30), stream.uniform(0.0, 1.0)
    shape = stream.choice(("straight", "arc", "bends"))
    turn = {
        "straight": np.zeros(frames),
        "arc": np.full(frames, turning),
        "bends": turning * np.sin(2.0 * np.pi * (rate * t + start)),
    }[shape]
    going, over = np.ones(frames), (-frames, 2 * frames)
    if there:
        begin = round(stream.uniform(0.03, 0.08) * frames)
        end = frames - round(stream.uniform(0.03, 0.08) * frames)
        soft = min(stream.uniform(20.0, 28.0), 0.4 * (end - begin))
        going = plateau(FPS * t, begin, begin + soft, end - soft, end)
        over = (begin, end)
    pace = speed * going * (1.0 + wander(stream, t, 0.03, 0.1, 0.4))
    heading = facing + summed(turn * going)
    return Way(heading, summed(pace[:, None] * ahead(heading)), pace, over)


def ahead(heading: np.ndarray) -> np.ndarray:
    """``(..., 2)`` unit (x, z) of a heading."""
    return np.stack([np.sin(heading), np.cos(heading)], axis=-1)


def summed(rate: np.ndarray) -> np.ndarray:
    """What a rate a second, ``(frames, ...)``, comes to: 0 in the first frame."""
    steps = np.cumsum(0.5 * (rate[1:] + rate[:-1]), axis=0) / FPS
    return np.concatenate([np.zeros_like(rate[:1]), steps])
