"""Legs in the air: a foot's way from one plant to the next as angles of hip and knee."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..curves import plateau, through
from ..score import Air, Plant

_THIGH, _SHANK = 0.455, 0.468
"""Leg lengths, of a usual leg."""


def hung(thigh: np.ndarray, knee: np.ndarray, out: float | np.ndarray = 0.0) -> np.ndarray:
    """``(..., 3)`` reach from hip to ankle of a usual leg with the thigh so far forward and the knee so far
    bent, radians; ``out``: leg lengths outward."""
    shin = thigh - knee
    return np.stack(
        [
            np.zeros_like(thigh) + out,
            -_THIGH * np.cos(thigh) - _SHANK * np.cos(shin),
            _THIGH * np.sin(thigh) + _SHANK * np.sin(shin),
        ],
        axis=-1,
    )


def carried(
    plants: Sequence[Plant],
    frames: int,
    shares: Sequence[float],
    thigh: Sequence[float],
    knee: Sequence[float],
    *,
    full: tuple[float, float] = (0.3, 0.75),
    most: float = 1.0,
    point: float = 0.25,
    out: float = -0.02,
) -> Air:
    """The air of every swing between plants.

    shares, thigh, knee: degrees at shares of a swing. full: shares between which the foot is where these
    angles say, to the part ``most``. point: of the toes, radians.
    """
    t, zero = np.arange(frames, dtype=float), np.zeros(frames)
    weight, bent = zero.copy(), [zero.copy(), zero.copy()]
    for plant, after in pairwise(plants):
        inside = (t > plant.off) & (t < after.strike)
        share = (t[inside] - plant.off) / (after.strike - plant.off)
        weight[inside] = most * plateau(share, 0.0, full[0], full[1], 1.0)
        for row, values in zip(bent, (thigh, knee), strict=True):
            row[inside] = np.radians(through(share, shares, values))
    return Air(reach=hung(bent[0], bent[1], out), weight=weight, swivel=zero, point=zero + point)
