"""Forward kinematics in NumPy: from local rotations to places and orientations in the world."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.skeleton import Skeleton


def forward(skeleton: Skeleton, rotations: np.ndarray, root: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places and orientations of all joints in the world.

    rotations: ``(..., joints, 4)`` local unit quaternions, w first; the leading axes are mostly (frames,).
    root:      ``(..., 3)`` metres, the root joint's place in the world.
    Returns ``(..., joints, 3)`` metres and ``(..., joints, 4)`` unit quaternions.
    """
    parents = skeleton.parents
    turned = np.array(rotations, dtype=np.float64)
    levels = _levels(parents.tobytes())
    for joints, above in levels:
        turned[..., joints, :] = rotation.multiply(turned[..., above, :], turned[..., joints, :])
    places = np.empty((*turned.shape[:-1], 3))
    places[..., 0, :] = root
    places[..., 1:, :] = rotation.rotate(turned[..., parents[1:], :], skeleton.offsets[1:])
    for joints, above in levels:
        places[..., joints, :] += places[..., above, :]
    return places, turned


def local_from_global(skeleton: Skeleton, globals_: np.ndarray) -> np.ndarray:
    """``(..., joints, 4)`` local rotations that give these world orientations ``(..., joints, 4)``."""
    local = np.array(globals_, dtype=np.float64)
    above = local[..., skeleton.parents[1:], :]
    local[..., 1:, :] = rotation.multiply(rotation.conjugate(above), local[..., 1:, :])
    return local


@lru_cache(maxsize=1024)
def _levels(parents: bytes) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Per level of the tree below the root: its joints and their parents."""
    tree = np.frombuffer(parents, dtype=np.int64)
    depth = np.zeros(len(tree), dtype=int)
    for joint in range(1, len(tree)):
        depth[joint] = depth[tree[joint]] + 1
    levels = (np.flatnonzero(depth == level) for level in range(1, depth.max() + 1))
    return tuple((joints, tree[joints]) for joints in levels)
