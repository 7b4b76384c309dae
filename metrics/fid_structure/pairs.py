"""KID, coverage and density: distances of two sets of feature vectors over all pairs of their windows.

Only pairs of windows of different groups (source clips) count: windows of one clip overlap and are no
independent draws. Where every window is a group of its own these are the published definitions.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar
from weakref import WeakKeyDictionary, ref

import numpy as np

from retarget_bench.api import Sample

NEIGHBOURS = 5
LISTED = 64
"""Neighbours of a window that are put in order: most often enough for any part of a set."""

Value = TypeVar("Value")


def apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``(n, m)`` bool: which pairs of windows are of different groups; labels ``(n,)`` and ``(m,)``.

    Labels are numbered first: comparing a million pairs of texts takes longer than any distance.
    """
    _, numbers = np.unique(np.concatenate([a, b]), return_inverse=True)
    return np.asarray(numbers[: len(a), None] != numbers[len(a) :])


class PerPair(Generic[Value]):
    """A function of two whole sets whose results are kept for as long as both of them live."""

    def __init__(self, make: Callable[[Sample, Sample], Value]) -> None:
        self._make = make
        self._made: WeakKeyDictionary[Sample, WeakKeyDictionary[Sample, Value]] = WeakKeyDictionary()

    def __call__(self, a: Sample, b: Sample) -> Value:
        others = self._made.setdefault(a, WeakKeyDictionary())
        if b not in others:
            others[b] = self._make(a, b)
        return others[b]


def superset(sample: Sample) -> tuple[Sample, np.ndarray]:
    """The set that a set is a part of, and its windows there; itself and all where it is none."""
    if sample.whole is None or sample.rows is None:
        return sample, np.arange(len(sample.clips))
    return sample.whole, sample.rows


# KID
class Kid:
    """``mean k(a, a') + mean k(b, b') - 2 mean k(a, b)`` with ``k(x, y) = (x y / d + 1)^3``.

    Means over pairs of one clip would raise the distance of two sets of the same distribution above 0. Not
    a number where a set has one group only. Kernels of all pairs of whole sets are kept for their parts.
    """

    def __init__(self) -> None:
        self._kernels = PerPair(_kernel)

    def __call__(self, a: Sample, b: Sample) -> float:
        return self._mean(a, a) + self._mean(b, b) - 2.0 * self._mean(a, b)

    def _mean(self, x: Sample, y: Sample) -> float:
        (all_x, rows), (all_y, columns) = superset(x), superset(y)
        one, other = np.zeros(len(all_x.clips)), np.zeros(len(all_y.clips))
        one[rows], other[columns] = 1.0, 1.0
        pairs = _pairs(x.clips, y.clips)
        return float(one @ self._kernels(all_x, all_y) @ other / pairs) if pairs else float("nan")


def _kernel(x: Sample, y: Sample) -> np.ndarray:
    """``(n, m)``: 0 for pairs of one group."""
    kernel = x.features @ y.features.T
    kernel /= x.features.shape[1]
    kernel += 1.0
    kernel *= kernel * kernel
    kernel *= apart(x.clips, y.clips)
    return np.asarray(kernel)


def _pairs(a: np.ndarray, b: np.ndarray) -> int:
    """Number of pairs of different groups."""
    (names, counts), (other_names, other_counts) = (np.unique(x, return_counts=True) for x in (a, b))
    _, rows, other_rows = np.intersect1d(names, other_names, assume_unique=True, return_indices=True)
    return int(len(a) * len(b) - counts[rows] @ other_counts[other_rows])


# coverage and density
class Fit(NamedTuple):
    """coverage: share of real windows with a generated one in their ball; at most 1.
    density: how many balls of real windows a generated one lies in, over k; about 1 for real motion."""

    coverage: float
    density: float


class Fits:
    """Coverage and density (Naeem et al. 2020); distances within whole sets are kept for their parts.

    The ball of a real window reaches to its k-th nearest real window *of another group*, and only generated
    windows of other groups count in it. Not a number where there are too few others.
    """

    def __init__(self, k: int = NEIGHBOURS) -> None:
        self._k = k
        self._near = PerPair(_near)
        self._across = PerPair(_across)
        self._last: WeakKeyDictionary[Sample, tuple[ref[Sample], Fit]] = WeakKeyDictionary()

    def __call__(self, real: Sample, generated: Sample) -> Fit:
        of, fit = self._last.get(real, (None, None))
        if of is None or fit is None or of() is not generated:
            fit = self._fit(real, generated)
            self._last[real] = ref(generated), fit
        return fit

    def _fit(self, real: Sample, generated: Sample) -> Fit:
        (all_real, rows), (all_made, columns) = superset(real), superset(generated)
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
