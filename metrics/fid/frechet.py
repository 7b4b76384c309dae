"""The Fréchet distance of two sets of feature vectors, for any number of them."""

from __future__ import annotations

import numpy as np


def frechet(a: np.ndarray, b: np.ndarray) -> float:
    """``|m_a - m_b|^2 + tr(C_a + C_b - 2 (C_a C_b)^(1/2))`` of sets ``(n, d)`` and ``(m, d)``.

    The covariances are never formed: with centred samples ``A = Q R`` is ``C_a = R^T R / (n - 1)``, and the
    trace of the root is the sum of the singular values of ``R_a R_b^T``. So one path serves any n, also
    below d, where the covariances are singular and their product has no stable root.
    """
    return _frechet(a.mean(axis=0) - b.mean(axis=0), factor(a), factor(b))


def factor(sample: np.ndarray) -> np.ndarray:
    """A triangular ``(min(n, d), d)`` factor of the covariance of a set ``(n, d)``, n at least 2."""
    centred = sample - sample.mean(axis=0)
    triangle = np.asarray(np.linalg.qr(centred, mode="r"))
    return triangle / np.sqrt(len(sample) - 1)


def trace(sample: np.ndarray) -> float:
    """The trace of the covariance: the scale on which a distance is large or small."""
    return float(sample.var(axis=0, ddof=1).sum())


def _frechet(apart: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    common = np.linalg.svd(a @ b.T, compute_uv=False).sum()
    return max(float(apart @ apart + (a * a).sum() + (b * b).sum() - 2.0 * common), 0.0)
