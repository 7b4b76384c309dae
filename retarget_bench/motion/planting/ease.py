"""Corrections that are known in some frames, carried smoothly over the others."""

import numpy as np

from retarget_bench.motion.contact import runs

FADE = 1 / 3
"""Seconds over which a correction comes and goes where no other one is near."""


def smoothstep(share: np.ndarray) -> np.ndarray:
    """0 below 0, 1 above 1, level at both ends (3 t^2 - 2 t^3)."""
    t = np.clip(share, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def spread(values: np.ndarray, known: np.ndarray, fps: float) -> np.ndarray:
    """``values`` ``(frames, n)`` kept where ``known`` ``(frames,)``, eased over everything else.

    Between two known stretches that are near each other one correction turns into the next, as a foot
    swings from step to step; where they are further apart than two fades, or at the ends of the clip, a
    correction fades to nothing.
    """
    out = np.where(known[:, None], values, 0.0)
    fade = FADE * fps
    for first, last in runs(~known):
        at = np.arange(first, last)
        before, after = first - 1, last
        has_before, has_after = before >= 0, after < len(known)
        leaving, coming = 1.0 - smoothstep((at - before) / fade), 1.0 - smoothstep((after - at) / fade)
        if has_before and has_after and after - before <= 2 * fade:
            coming = smoothstep((at - before) / (after - before))
            leaving = 1.0 - coming
        if has_before:
            out[first:last] += leaving[:, None] * values[before]
        if has_after:
            out[first:last] += coming[:, None] * values[after]
    return out


def smooth(curves: np.ndarray, fps: float, seconds: float = FADE) -> np.ndarray:
    """``(frames, n)`` a Hann average over so many seconds; the ends are held."""
    half = max(1, round(seconds * fps / 2))
    window = np.hanning(2 * half + 3)[1:-1]
    padded = np.pad(curves, ((half, half), (0, 0)), mode="edge")
    return np.stack([np.convolve(each, window / window.sum(), mode="valid") for each in padded.T], axis=1)


def limited(curves: np.ndarray, most: np.ndarray) -> np.ndarray:
    """``(frames, n)`` curves whose steps are at most ``most`` ``(frames - 1, n)``.

    Halfway between the greatest such curve below the given one and the least one above it: where the curve
    is slow enough for as far as it matters, it stays.
    """
    way = np.concatenate([np.zeros_like(most[:1]), np.cumsum(most, axis=0)])

    def below(values: np.ndarray) -> np.ndarray:
        later = np.minimum.accumulate(values - way) + way
        return np.minimum(later, np.minimum.accumulate((values + way)[::-1])[::-1] - way)

    return (below(curves) - below(-curves)) / 2.0
