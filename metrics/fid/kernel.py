"""The kernel distance of two sets of feature vectors: a squared maximum mean discrepancy without bias."""

import numpy as np

from retarget_bench.api import Sample

from .pairs import PerPair, apart, whole


def kid(a: np.ndarray, b: np.ndarray, a_groups: np.ndarray, b_groups: np.ndarray) -> float:
    """``mean k(a, a') + mean k(b, b') - 2 mean k(a, b)`` with ``k(x, y) = (x y / d + 1)^3``.

    a, b: sets ``(n, d)`` and ``(m, d)``; groups: ``(n,)`` and ``(m,)`` labels. The means go over pairs of
    different groups: windows of one clip are no independent draws, and counting their pairs would raise
    the distance of two sets of the same distribution above 0. Where every window is a group of its own it
    is the usual estimator. Not a number where a set has one group only.
    """
    return Kid()(Sample(a, a_groups), Sample(b, b_groups))


class Kid:
    """KID of sets that may be parts of others: the kernels of all pairs of the whole are kept."""

    def __init__(self) -> None:
        self._kernels = PerPair(_kernel)

    def __call__(self, a: Sample, b: Sample) -> float:
        return self._mean(a, a) + self._mean(b, b) - 2.0 * self._mean(a, b)

    def _mean(self, x: Sample, y: Sample) -> float:
        (all_x, rows), (all_y, columns) = whole(x), whole(y)
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
    """How many pairs are of different groups."""
    (names, counts), (other_names, other_counts) = (np.unique(x, return_counts=True) for x in (a, b))
    _, ours, theirs = np.intersect1d(names, other_names, assume_unique=True, return_indices=True)
    return int(len(a) * len(b) - counts[ours] @ other_counts[theirs])
