"""Errors of methods whose truth is known, with the clusters of real results.

The number of pairs per source clip is that of the cross split of puppets-1.0 default (94 clips, 780
cases). Errors are products of log-normal factors: how hard a clip is, how hard its pair of bodies is, and
the method's own luck with either. The spreads are chosen so that means per clip vary, within and between
clips, and lean to one side, as those of mpjpe_h.world do there.
"""

from __future__ import annotations

import numpy as np

PAIRS = np.array([9] * 76 + [8] * 10 + [2] * 8)
CLIP, BODIES = 0.35, 0.45
"""Spread of the logarithm of what all methods have in common: per clip, per pair of bodies."""
OWN = (0.25, 0.4)
"""Likewise of a method's own luck, with the clip and with the pair."""
STEADY = (0.08, 0.4)
"""Of a method that is as good on average and does not fail on single clips."""
RECKLESS = (0.7, 0.4)
"""Of one that does well on most clips and badly on few, and is as good on average."""


def errors(
    random: np.random.Generator, repeats: int, clips: int, methods: tuple[tuple[float, float], ...]
) -> np.ndarray:
    """Means per clip ``(methods, repeats, clips)`` of errors whose expectation is the same for all."""
    pairs = random.choice(PAIRS, size=clips)
    most = int(pairs.max())
    there = np.arange(most) < pairs[:, None]
    shape = (repeats, clips, most)
    shared = factor(random, CLIP, (*shape[:2], 1)) * factor(random, BODIES, shape)
    means = []
    for clip, pair in methods:
        cases = shared * factor(random, clip, (*shape[:2], 1)) * factor(random, pair, shape)
        means.append((cases * there).sum(axis=2) / pairs)
    return np.array(means)


def factor(random: np.random.Generator, spread: float, shape: tuple[int, ...]) -> np.ndarray:
    """Log-normal numbers of mean 1."""
    return np.exp(spread * random.standard_normal(shape) - spread**2 / 2)


def failures(random: np.random.Generator, shape: tuple[int, ...], share: float, times: float) -> np.ndarray:
    """Factors of mean 1 on errors: so many times on a share of the clips, and less than 1 on the others."""
    return np.where(random.random(shape) < share, times, (1 - share * times) / (1 - share))
