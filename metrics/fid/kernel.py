"""The kernel distance of two sets of feature vectors: a squared maximum mean discrepancy without bias."""

from __future__ import annotations

import numpy as np


def kid(a: np.ndarray, b: np.ndarray, a_groups: np.ndarray, b_groups: np.ndarray) -> float:
    """``mean k(a, a') + mean k(b, b') - 2 mean k(a, b)`` with ``k(x, y) = (x y / d + 1)^3``.

    a, b: sets ``(n, d)`` and ``(m, d)``; groups: ``(n,)`` and ``(m,)`` labels. The means go over pairs of
    different groups: windows of one clip are no independent draws, and counting their pairs would raise
    the distance of two sets of the same distribution above 0. Where every window is a group of its own it
    is the usual estimator. Not a number where a set has one group only.
    """
    within = _mean(a, a, a_groups, a_groups) + _mean(b, b, b_groups, b_groups)
    return within - 2.0 * _mean(a, b, a_groups, b_groups)


def _mean(x: np.ndarray, y: np.ndarray, x_groups: np.ndarray, y_groups: np.ndarray) -> float:
    kernel = x @ y.T
    kernel /= x.shape[1]
    kernel += 1.0
    kernel *= kernel * kernel
    apart = x_groups[:, None] != y_groups
    pairs = int(apart.sum())
    return float(kernel[apart].sum() / pairs) if pairs else float("nan")
