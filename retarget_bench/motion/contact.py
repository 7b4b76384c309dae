"""Planted joints, found by their speed."""

import numpy as np

CONTACT_SPEED = 0.003
"""Body heights per frame at 30 frames per second; slower than this is planted (SAN's foot contact rule)."""

CONTACT_ROLES = ("left_foot", "left_toe", "right_foot", "right_toe")
"""The joints that contacts are labelled on, where a body has them."""


def planted(positions: np.ndarray, height: float, fps: float, limit: float = CONTACT_SPEED) -> np.ndarray:
    """Contact labels by speed: moved since the frame before by less than ``limit * 30 / fps`` heights.

    positions: ``(frames, joints, 3)`` metres, the contact joints only. height: metres.
    Returns ``(frames, joints)`` bool. The first frame has no frame before it and takes the label of the
    second; a motion of one frame has no speed and no contact.
    """
    if len(positions) < 2:
        return np.zeros(positions.shape[:2], dtype=bool)
    steps = np.diff(positions, axis=0)
    slow = np.einsum("fjc,fjc->fj", steps, steps) < (limit * 30.0 / fps * height) ** 2
    return np.concatenate([slow[:1], slow])


def runs(labels: np.ndarray) -> np.ndarray:
    """Unbroken stretches of a label ``(frames,)``: ``(stretches, 2)``, first frame and past-the-last."""
    edges = np.diff(np.concatenate([[0], labels.astype(np.int8), [0]]))
    return np.stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)], axis=1)


def tidy(labels: np.ndarray, gap: int, shortest: int) -> np.ndarray:
    """Labels ``(frames,)``: gaps up to ``gap`` frames closed, then stretches under ``shortest`` dropped."""
    out = labels.copy()
    for first, last in runs(~labels):
        if first > 0 and last < len(labels) and last - first <= gap:
            out[first:last] = True
    for first, last in runs(out):
        if last - first < shortest:
            out[first:last] = False
    return out
