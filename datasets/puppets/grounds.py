"""The floor of a case: flat, or with the performance's stairs in the performer's own measure."""

from __future__ import annotations

import math

import numpy as np

from retarget_bench.api import Ground

from .bodies import Body
from .score import Score, Stairs

_SAMPLES = 40
"""Of the floor along one tread; risers are as wide as the distance of two samples."""


def ground(score: Score, body: Body) -> Ground:
    """The floor under a body that performs the score."""
    if score.stairs is None:
        return Ground(0.0)
    return _steps(score.stairs, body.proportions.leg)


def _steps(stairs: Stairs, leg: float) -> Ground:
    """A height field of one row or column: floors go on sideways, and before and behind the steps."""
    spacing = stairs.tread * leg / _SAMPLES
    samples = np.arange(_SAMPLES * stairs.count + 1)
    heights = leg * (
        stairs.level + stairs.rise * np.minimum((samples + _SAMPLES - 1) // _SAMPLES, stairs.count)
    )
    x, z = (leg * place for place in stairs.edge)
    quarter = round(stairs.heading / (0.5 * math.pi)) % 4
    # the first sample lies half a spacing before the first riser, seen in the direction of travel
    start = -0.5 * spacing
    if quarter in (2, 3):
        heights, start = heights[::-1], 0.5 * spacing - spacing * (len(samples) - 1)
    if quarter in (0, 2):
        return Ground(0.0, heights[:, None], (x, z + start), spacing)
    return Ground(0.0, heights[None], (x + start, z), spacing)
