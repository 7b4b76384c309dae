"""Windows turned about the vertical axis until the body stands as in its template, and back again.

Which way somebody goes is nothing that a code need tell: turned ahead, half as many numbers say the same.
"""

from __future__ import annotations

import numpy as np


def headings(
    places: np.ndarray, template: np.ndarray, joints: np.ndarray, frames: np.ndarray
) -> np.ndarray:
    """``(rows,)`` radians: the turn, Z up, that brings each template nearest to the mean over frames.

    places: ``(rows, frames, joints, 3)``. template: ``(rows, joints, 3)``. joints: ``(rows, joints)`` and
    frames: ``(rows, frames)`` bool, what is real. The least squares have a closed form, as only one angle
    is sought; 0 where every turn is as good.
    """
    real = frames[:, :, None, None]
    mean = np.where(real, places[..., :2], 0.0).sum(1) / real.sum(1)
    seen, still = (_level(each, joints) for each in (mean, template[..., :2]))
    return np.angle((seen * still.conj()).sum(1))


def _level(places: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """``(rows, joints)`` complex, about the mean of real joints, zero where there is none."""
    found = np.where(joints, places[..., 0] + 1j * places[..., 1], 0.0)
    return np.where(joints, found - found.sum(1, keepdims=True) / joints.sum(1, keepdims=True), 0.0)


def turned(places: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Places ``(rows, ..., 3)`` turned by an angle ``(rows,)`` each."""
    level = (places[..., 0] + 1j * places[..., 1]) * np.exp(1j * angles).reshape(
        -1, *[1] * (places.ndim - 2)
    )
    return np.stack([level.real, level.imag, places[..., 2]], axis=-1).astype(places.dtype)
