"""Curves over time that performances are drawn with. All have a continuous velocity."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from .randomness import Stream


def smooth(share: np.ndarray | float) -> np.ndarray:
    """0 below 0, 1 above 1, between them the quintic with no velocity and no acceleration at its ends."""
    x = np.clip(share, 0.0, 1.0)
    return x * x * x * (x * (6.0 * x - 15.0) + 10.0)


def ramp(t: np.ndarray, start: float, end: float) -> np.ndarray:
    """0 until ``start``, 1 from ``end`` on."""
    return smooth((t - start) / (end - start))


def plateau(t: np.ndarray, rise: float, top: float, fall: float, end: float) -> np.ndarray:
    """0, up from ``rise`` to ``top``, exactly 1 until ``fall``, down to 0 at ``end``."""
    return ramp(t, rise, top) * (1.0 - ramp(t, fall, end))


def bump(share: np.ndarray) -> np.ndarray:
    """0 at 0 and 1, 1 in the middle, flat at both ends."""
    x = np.clip(share, 0.0, 1.0)
    return 64.0 * (x * (1.0 - x)) ** 3


def hermite(
    t: np.ndarray, ends: tuple[float, float], values: tuple[float, float], slopes: tuple[float, float]
) -> np.ndarray:
    """The cubic between two times with given values and slopes (per unit of ``t``)."""
    span = ends[1] - ends[0]
    x = np.clip((t - ends[0]) / span, 0.0, 1.0)
    back = 1.0 - x
    level = values[0] * (1.0 + 2.0 * x) * back * back + values[1] * (3.0 - 2.0 * x) * x * x
    lean = slopes[0] * x * back * back - slopes[1] * x * x * back
    return level + span * lean


def through(t: np.ndarray, times: Sequence[float], values: Sequence[float]) -> np.ndarray:
    """A cubic curve through points: Catmull and Rom's slopes inside, at rest before and after."""
    slopes = [0.0] * len(times)
    for k in range(1, len(times) - 1):
        slopes[k] = (values[k + 1] - values[k - 1]) / (times[k + 1] - times[k - 1])
    return spline(t, times, values, slopes)


def spline(
    t: np.ndarray, times: Sequence[float], values: Sequence[float], slopes: Sequence[float]
) -> np.ndarray:
    """Cubics through points with given slopes (per unit of ``t``); straight before and after. A parabola
    between two of its points is met exactly."""
    curve = values[0] + slopes[0] * (t - times[0])
    for k in range(len(times) - 1):
        at, to, by = ((row[k], row[k + 1]) for row in (times, values, slopes))
        piece = hermite(t, at, to, by)
        curve = np.where(t >= times[k], piece, curve)
    return np.where(t > times[-1], values[-1] + slopes[-1] * (t - times[-1]), curve)


def wander(
    stream: Stream, t: np.ndarray, amplitude: float, slow: float = 0.15, fast: float = 0.9
) -> np.ndarray:
    """Band-limited noise: four sines between ``slow`` and ``fast`` hertz, about ``amplitude`` in size."""
    total = np.zeros_like(t)
    for _ in range(4):
        rate = stream.uniform(slow, fast)
        total += stream.normal(0.5) * np.sin(2.0 * np.pi * (rate * t + stream.uniform(0.0, 1.0)))
    return amplitude * total


def lower_envelope(values: np.ndarray, reach: int) -> np.ndarray:
    """A smooth curve that is nowhere above ``values``: the minimum over ``reach`` frames either side,
    averaged over the same window with a Hann weight."""
    if reach < 1:
        return values
    ends = np.full(2 * reach, values[0]), np.full(2 * reach, values[-1])
    padded, length = np.concatenate([ends[0], values, ends[1]]), len(values) + 2 * reach
    low = padded[:length].copy()
    for k in range(1, 2 * reach + 1):
        np.minimum(low, padded[k : k + length], out=low)
    return np.convolve(low, _hann(2 * reach + 1), mode="valid")


@cache
def _hann(width: int) -> np.ndarray:
    """Weights of a window, which sum to 1."""
    weights = np.hanning(width + 2)[1:-1]
    return np.asarray(weights / weights.sum())


def soft_min(a: np.ndarray, b: np.ndarray, width: float) -> np.ndarray:
    """A smooth curve just below the smaller of two, nearer than ``width`` where they cross."""
    return 0.5 * (a + b - np.sqrt((a - b) ** 2 + width * width))
