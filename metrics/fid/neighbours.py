"""Coverage and density of a generated set in a real one (Naeem et al. 2020)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

NEIGHBOURS = 5


class Fit(NamedTuple):
    """coverage: share of real windows with a generated one in their ball; at most 1.
    density: how many balls of real windows a generated one lies in, over k; about 1 for real motion."""

    coverage: float
    density: float


def fit(
    real: np.ndarray,
    generated: np.ndarray,
    real_groups: np.ndarray,
    generated_groups: np.ndarray,
    k: int = NEIGHBOURS,
) -> Fit:
    """Coverage and density of sets ``(n, d)`` and ``(m, d)``.

    groups: ``(n,)`` and ``(m,)`` labels. The ball of a real window reaches to its k-th nearest real window
    *of another group*, and only generated windows of other groups count in it: else the overlapping
    windows of its own clip would make it too small for anybody else's. Where every window is a group of
    its own it is the published definition. Not a number where there are too few others.
    """
    among = _squares(real, real)
    among[real_groups[:, None] == real_groups] = np.inf
    if len(real) <= k:
        return Fit(float("nan"), float("nan"))
    reach = np.partition(among, k - 1, axis=1)[:, k - 1]
    if not np.isfinite(reach).all():
        return Fit(float("nan"), float("nan"))
    inside = (_squares(real, generated) < reach[:, None]) & (real_groups[:, None] != generated_groups)
    return Fit(float(inside.any(axis=1).mean()), float(inside.sum() / (k * len(generated))))


def _squares(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``(n, m)`` squared distances."""
    own, other = (a * a).sum(axis=1), (b * b).sum(axis=1)
    return np.maximum(own[:, None] + other - 2.0 * (a @ b.T), 0.0)
