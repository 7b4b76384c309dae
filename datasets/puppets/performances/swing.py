"""Legs in the air: a foot's way from one plant to the next as angles of hip and knee."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
    curve: Callable[[np.ndarray, Sequence[float], Sequence[float]], np.ndarray] = through,
) -> Air:
    """The air of every swing between plants.

    shares, thigh, knee: degrees at shares of a swing. full: shares between which the foot is where these
    angles say, to the part ``most``. point: of the toes, radians. curve: through the angles.
    """
    t, zero = np.arange(frames, dtype=float), np.zeros(frames)
    weight, bent = zero.copy(), [zero.copy(), zero.copy()]
    for plant, after in pairwise(plants):
        inside = (t > plant.off) & (t < after.strike)
        share = (t[inside] - plant.off) / (after.strike - plant.off)
        weight[inside] = most * plateau(share, 0.0, full[0], full[1], 1.0)
        for row, values in zip(bent, (thigh, knee), strict=True):
            row[inside] = np.radians(curve(share, shares, values))
    return Air(reach=hung(bent[0], bent[1], out), weight=weight, swivel=zero, point=zero + point)


def flowing(t: np.ndarray, times: Sequence[float], values: Sequence[float]) -> np.ndarray:
    """The natural cubic spline through points, between the first and the last: its acceleration is
    continuous, which ``through`` does not promise."""
    at, y = np.array(times, dtype=float), np.array(values, dtype=float)
    span, last = np.diff(at), len(at) - 1
    slope = np.diff(y) / span
    system, right = np.eye(last + 1), np.zeros(last + 1)
    for k in range(1, last):
        system[k, k - 1 : k + 2] = span[k - 1], 2.0 * (span[k - 1] + span[k]), span[k]
        right[k] = 6.0 * (slope[k] - slope[k - 1])
    bent = np.linalg.solve(system, right)
    piece = np.clip(np.searchsorted(at, t, side="right") - 1, 0, last - 1)
    since, left, h = t - at[piece], at[piece + 1] - t, span[piece]
    curve = (bent[piece] * left**3 + bent[piece + 1] * since**3) / (6.0 * h)
    curve += (y[piece] / h - bent[piece] * h / 6.0) * left
    curve += (y[piece + 1] / h - bent[piece + 1] * h / 6.0) * since
    return np.asarray(curve)
