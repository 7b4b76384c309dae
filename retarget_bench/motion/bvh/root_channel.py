"""Whether a file states the root's place in the world or relative to its OFFSET.

Both are in use, and no file says which. The readings differ by the root's OFFSET, so that the wrong one
puts the body about a hip height too low or too high; that is what the decision rests on.
"""

from __future__ import annotations

import numpy as np

from retarget_bench.motion import kinematics
from retarget_bench.motion.skeleton import Skeleton

_UP_AXES = (1, 2)
_HIP_HEIGHT = (0.3, 1.5)
"""A standing root's height as a share of its reach: what tells a rest height from an arbitrary place."""
_SUNK = (0.75, 1.25)
"""Bodies that climb or hang are up to 0.6 of that height below 0 in files with absolute places."""
_FRAMES = 32


def is_relative(
    skeleton: Skeleton, rotations: np.ndarray, absolute: np.ndarray, relative: np.ndarray
) -> bool:
    """Whether the root's places ``(frames, 3)`` are those of ``relative`` and not those of ``absolute``.

    They are relative when the absolute reading leaves the body's lowest joint one OFFSET height below 0
    (0.75 to 1.25 of it, median over frames), and the OFFSET is a hip height and not the first frame.
    """
    size = reach(skeleton)
    shift = (relative - absolute).mean(axis=0)
    if np.abs(absolute[0] - shift).max() <= 1e-4 * size:
        return False
    for up in _UP_AXES:
        if _HIP_HEIGHT[0] * size <= shift[up] <= _HIP_HEIGHT[1] * size:
            return _sinks(skeleton, rotations, absolute, up, shift[up])
    return False


def _sinks(skeleton: Skeleton, rotations: np.ndarray, places: np.ndarray, up: int, height: float) -> bool:
    if np.median(places[:, up]) > 0.5 * height:
        return False  # no body reaches that far below its root; this spares most files the kinematics
    some = np.unique(np.linspace(0, len(places) - 1, _FRAMES).astype(int))
    joints, _ = kinematics.forward(skeleton, rotations[some], places[some])
    sunk = -np.median(joints[:, :, up].min(axis=1)) / height
    return bool(_SUNK[0] <= sunk <= _SUNK[1])


def reach(skeleton: Skeleton) -> float:
    """The longest way from the root along the bones to a joint: the body's size, whatever its pose."""
    along = skeleton.bone_lengths.tolist()
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if parent >= 0:
            along[joint] += along[parent]
    return max(along)
