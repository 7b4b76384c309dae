"""Procrustes alignment of point sets by least squares (Kabsch 1976, Umeyama 1991)."""

import numpy as np

RIGID = "R a proper rotation (determinant +1, so a mirrored body does not fit), t a translation"
SIMILAR = "s a positive scale, R a proper rotation (determinant +1), t a translation"
"""The definition of fits in the formulas of metrics."""


def residuals(moving: np.ndarray, fixed: np.ndarray) -> tuple[float, float]:
    """Mean distance left after the best rigid fit, and after the best similarity fit.

    Both are point sets ``(sets, points, 3)``; each set of ``moving`` is fitted onto its own of ``fixed``.
    """
    turn, scale = fits(moving, fixed)
    moving = moving - moving.mean(axis=1, keepdims=True)
    fixed = fixed - fixed.mean(axis=1, keepdims=True)
    turned = moving @ turn.transpose(0, 2, 1)
    rigid = np.sqrt(_squares(turned - fixed)).mean()
    similar = np.sqrt(_squares(turned * scale[:, None, None] - fixed)).mean()
    return float(rigid), float(similar)


def fits(moving: np.ndarray, fixed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations ``(sets, 3, 3)`` and scales ``(sets,)`` that fit point sets ``(sets, points, 3)`` about
    their means by least squares.

    A reflection is never used. Points that all coincide keep scale 1.
    """
    moving = moving - moving.mean(axis=1, keepdims=True)
    fixed = fixed - fixed.mean(axis=1, keepdims=True)
    u, spread, vt = np.linalg.svd(fixed.transpose(0, 2, 1) @ moving)
    # where the best orthogonal map is a reflection, the weakest axis is turned round
    flip = np.where(np.linalg.det(u) * np.linalg.det(vt) < 0, -1.0, 1.0)
    u[..., 2] *= flip[:, None]
    spread[:, 2] *= flip
    size = np.einsum("fjc,fjc->f", moving, moving)
    return u @ vt, np.divide(spread.sum(axis=1), size, out=np.ones_like(size), where=size > 0)


def _squares(vectors: np.ndarray) -> np.ndarray:
    return np.einsum("fjc,fjc->fj", vectors, vectors)
