"""Coverage and density of a generated set in a real one (Naeem et al. 2020)."""

from dataclasses import dataclass
from typing import NamedTuple
from weakref import WeakKeyDictionary, ref

import numpy as np

from retarget_bench.api import Sample

from .pairs import PerPair, apart, whole

NEIGHBOURS = 5
LISTED = 64
"""Neighbours of a window that are put in order: most often enough for any part of a set."""


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
    return Fits(k)(Sample(real, real_groups), Sample(generated, generated_groups))


class Fits:
    """Coverage and density of sets that may be parts of others: distances of the whole are kept."""

    def __init__(self, k: int = NEIGHBOURS) -> None:
        self._k = k
        self._near = PerPair(_near)
        self._across = PerPair(_across)
        self._last: WeakKeyDictionary[Sample, tuple[ref[Sample], Fit]] = WeakKeyDictionary()

    def __call__(self, real: Sample, generated: Sample) -> Fit:
        of, found = self._last.get(real, (None, None))
        if of is None or found is None or of() is not generated:
            found = self._fit(real, generated)
            self._last[real] = ref(generated), found
        return found

    def _fit(self, real: Sample, generated: Sample) -> Fit:
        (all_real, rows), (all_made, columns) = whole(real), whole(generated)
        reach = self._near(all_real, all_real).reach(rows, self._k)
        if reach is None:
            return Fit(float("nan"), float("nan"))
        inside = self._across(all_real, all_made)[np.ix_(rows, columns)] < reach[:, None]
        return Fit(float(inside.any(axis=1).mean()), float(inside.sum() / (self._k * len(columns))))


@dataclass(frozen=True, eq=False)
class _Near:
    """Real windows among each other. squares: ``(n, n)``, infinite within a group. order: ``(n, LISTED)``
    the nearest of each, nearest first."""

    squares: np.ndarray
    order: np.ndarray

    def reach(self, rows: np.ndarray, k: int) -> np.ndarray | None:
        """``(rows,)`` squared distance to the k-th nearest of these rows; None where one has too few."""
        if len(rows) <= k:
            return None
        stays = np.zeros(len(self.squares), dtype=bool)
        stays[rows] = True
        order = self.order[rows]
        counted = stays[order].cumsum(axis=1)
        reach = self.squares[rows, order[np.arange(len(rows)), (counted >= k).argmax(axis=1)]]
        for row in np.flatnonzero(counted[:, -1] < k):  # too few of the listed ones stay
            reach[row] = np.partition(self.squares[rows[row], rows], k - 1)[k - 1]
        return reach if np.isfinite(reach).all() else None


def _near(real: Sample, _: Sample) -> _Near:
    squares = _squares(real.features, real.features)
    squares[~apart(real.clips, real.clips)] = np.inf
    listed = min(LISTED, len(squares))
    near = np.argpartition(squares, listed - 1, axis=1)[:, :listed]
    ranks = np.take_along_axis(squares, near, axis=1).argsort(axis=1)
    return _Near(squares, np.take_along_axis(near, ranks, axis=1))


def _across(real: Sample, generated: Sample) -> np.ndarray:
    """``(n, m)`` squared distances, infinite within a group."""
    squares = _squares(real.features, generated.features)
    squares[~apart(real.clips, generated.clips)] = np.inf
    return squares


def _squares(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``(n, m)`` squared distances."""
    own, other = (a * a).sum(axis=1), (b * b).sum(axis=1)
    return np.maximum(own[:, None] + other - 2.0 * (a @ b.T), 0.0)
