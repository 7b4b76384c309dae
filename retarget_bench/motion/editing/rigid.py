"""Motions moved as a whole: turned about the vertical axis and shifted."""

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.body import UP
from retarget_bench.motion.character import Motion


def moved(motion: Motion, angle: float, pivot: np.ndarray, shift: np.ndarray) -> Motion:
    """The motion turned by ``angle`` radians about the vertical axis through ``pivot`` ``(3,)``, then moved
    by ``shift`` ``(3,)`` or ``(frames, 3)`` metres. Left turns (from +Z towards +X) are positive."""
    turn = rotation.about(UP, angle)
    rotations = np.array(motion.rotations)
    rotations[:, 0] = rotation.multiply(turn[None], rotations[:, 0])
    root = rotation.rotate(turn[None], motion.root - pivot) + pivot + shift
    return motion.character.motion(rotations, root, motion.fps)


def heading(turned: np.ndarray) -> np.ndarray:
    """``(...)`` radians: the part of rotations ``(..., 4)`` that is about the vertical axis."""
    return np.asarray(2.0 * np.arctan2(turned[..., 2], turned[..., 0]))
