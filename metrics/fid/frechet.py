"""The Fréchet distance of two sets of feature vectors, for any number of them."""

from weakref import WeakKeyDictionary

import numpy as np

from retarget_bench.api import Sample

_SOUND = 1e-4
"""Sizes on a diagonal, relative to 1, from which a triangle is safely inverted."""


def frechet(a: np.ndarray, b: np.ndarray) -> float:
    """``|m_a - m_b|^2 + tr(C_a + C_b - 2 (C_a C_b)^(1/2))`` of sets ``(n, d)`` and ``(m, d)``.

    The covariances are never formed: with centred samples ``A = Q R`` is ``C_a = R^T R / (n - 1)``, and the
    trace of the root is the sum of the singular values of ``R_a R_b^T``. So one path serves any n, also
    below d, where the covariances are singular and their product has no stable root.
    """
    return _frechet(a.mean(axis=0) - b.mean(axis=0), factor(a), factor(b))


class Frechet:
    """The distance of sets whose factors are kept; that of a part of a set is made from the whole's."""

    def __init__(self) -> None:
        self._factors: WeakKeyDictionary[Sample, np.ndarray] = WeakKeyDictionary()

    def __call__(self, a: Sample, b: Sample) -> float:
        apart = a.features.mean(axis=0) - b.features.mean(axis=0)
        return _frechet(apart, self._factor(a), self._factor(b))

    def _factor(self, sample: Sample) -> np.ndarray:
        if sample not in self._factors:
            self._factors[sample] = self._new_factor(sample)
        return self._factors[sample]

    def _new_factor(self, sample: Sample) -> np.ndarray:
        if sample.whole is None or sample.rows is None or 2 * len(sample.rows) < len(sample.whole.clips):
            return factor(sample.features)
        shorter = without(self._factor(sample.whole), sample.whole.features, sample.rows)
        return factor(sample.features) if shorter is None else shorter


def without(factor: np.ndarray, features: np.ndarray, rows: np.ndarray) -> np.ndarray | None:
    """A factor of the covariance of some rows of a set ``(n, d)``, from the ``factor`` of all of them.

    What the others add is taken away: with R of all rows and W = G R^-1 of those left out, the scatter
    of the rest is R^T (1 - W^T W) R, so L^T R is its factor where L L^T is the middle. None where that is
    not well conditioned, and the rows have to be factored anew.
    """
    from scipy.linalg import solve_triangular  # type: ignore[import-untyped]

    sizes = np.abs(np.diagonal(factor))
    if factor.shape[0] != factor.shape[1] or not sizes.min() > _SOUND * sizes.max():
        return None
    centred = features - features.mean(axis=0)
    removed = np.delete(centred, rows, axis=0)
    # their own mean is what the rest is centred at: one row more to take away
    removed = np.concatenate([removed, removed.sum(axis=0, keepdims=True) / np.sqrt(len(rows))])
    triangle = factor * np.sqrt(len(features) - 1)
    share = solve_triangular(triangle, removed.T, trans="T", check_finite=False)
    try:
        middle = np.linalg.cholesky(np.eye(len(triangle)) - share @ share.T)
    except np.linalg.LinAlgError:
        return None
    if np.diagonal(middle).min() < _SOUND:
        return None
    return np.asarray(middle.T @ triangle / np.sqrt(len(rows) - 1))


def factor(sample: np.ndarray) -> np.ndarray:
    """A triangular ``(min(n, d), d)`` factor of the covariance of a set ``(n, d)``, n at least 2."""
    centred = sample - sample.mean(axis=0)
    triangle = np.asarray(np.linalg.qr(centred, mode="r"))
    return triangle / np.sqrt(len(sample) - 1)


def _frechet(apart: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    common = np.linalg.svd(a @ b.T, compute_uv=False).sum()
    return max(float(apart @ apart + (a * a).sum() + (b * b).sum() - 2.0 * common), 0.0)
