"""Paths of results: in place, or turned so that the character travels along an axis."""

from typing import Literal

import numpy as np

from retarget_bench.motion import facing, transfer
from retarget_bench.motion.character import Motion
from retarget_bench.motion.editing.rigid import moved

RootMotion = Literal["keep", "in-place", "x", "-x", "z", "-z"]

AXES = {"x": 1j, "-x": -1j, "z": 1.0, "-z": -1.0}
"""Directions on the floor as z + ix (``facing.py``)."""
_TRAVELS = 0.25
"""Body heights from the first place to the last, from which on a motion has a direction of travel."""


def in_place(motion: Motion) -> Motion:
    """The motion with its hips above their first place throughout; heights, turns and pose stay."""
    path = _hips(motion)
    shift = (path[0] - path) * [1.0, 0.0, 1.0]
    return moved(motion, 0.0, path[0], shift)


def along(motion: Motion, axis: str) -> Motion:
    """The motion turned about its first place so that it travels along an axis of ``AXES``.

    It travels from its first place to its last. Where these are less than a quarter of the body's height
    apart, the character faces along the axis in the first frame instead.
    """
    path = _hips(motion)
    way = (path[-1] - path[0]) * [1.0, 0.0, 1.0]
    direction = complex(way[2], way[0])
    if abs(direction) < _TRAVELS * motion.character.height:
        direction = complex(facing.facing(motion.positions[:1], motion.character)[0])
    return moved(motion, float(np.angle(AXES[axis] / direction)), path[0], np.zeros(3))


def edited(motion: Motion, root_motion: str) -> Motion:
    """The motion with the path that ``RootMotion`` names."""
    if root_motion == "keep" or not motion.frames:
        return motion
    return in_place(motion) if root_motion == "in-place" else along(motion, root_motion)


def _hips(motion: Motion) -> np.ndarray:
    """``(frames, 3)`` metres: the hips, or the root of a body without."""
    return transfer.hips(motion) if "hips" in motion.character.joint_of else motion.root
