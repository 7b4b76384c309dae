"""Shared conventions: frame rate, sides, headings, gravity."""

import numpy as np

FPS = 30.0


def seconds(frames: int) -> np.ndarray:
    """``(frames,)`` the time of each frame."""
    return np.arange(frames) / FPS


SIDES = ("left", "right")


def other(side: str) -> str:
    return "right" if side == "left" else "left"


def sign(side: str) -> int:
    """+1 for left (left is +X), -1 for right."""
    return 1 if side == "left" else -1


def along(heading: np.ndarray | float) -> np.ndarray:
    """Unit (x, z) of a heading: 0 faces +Z, growing to the left."""
    return np.stack([np.sin(heading), np.cos(heading)], axis=-1)


def across(heading: np.ndarray | float) -> np.ndarray:
    """Unit (x, z) to the left of a heading."""
    return np.stack([np.cos(heading), -np.sin(heading)], axis=-1)


GRAVITY = 9.81 / 0.92 / 30.0**2
"""Leg lengths per frame and frame, on a leg of 0.92 m: a man's of mean stature."""
