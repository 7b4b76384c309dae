"""Forward kinematics in NumPy: from local rotations to places and orientations in the world.

A quaternion w + xi + yj + zk is computed with as two complex numbers, w + xi and y + zi: that is the same
memory, and a product takes a quarter of the array operations. The chain of products runs over the whole
tree at once: by levels, or for short clips, where the calls cost more than the numbers, by doubling
(after step k every joint holds the product of its last 2^k local rotations).
"""

from functools import lru_cache

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import rotation
from retarget_bench.motion.skeleton import Skeleton

Steps = tuple[tuple[np.ndarray, np.ndarray], ...]
"""Per step the joints that are multiplied, and by the value of which other joints (from the left)."""

_BLOCK = 256
"""Frames computed at a time, so that intermediate results stay in the processor's cache."""
_SHORT = 64
"""Up to so many frames doubling is faster than going level by level (measured for 22 to 75 joints)."""


def forward(skeleton: Skeleton, rotations: np.ndarray, root: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places and orientations of all joints in the world.

    rotations: ``(..., joints, 4)`` local unit quaternions, w first; mostly ``(frames, joints, 4)``.
    root:      ``(..., 3)`` metres, the root joint's place in the world.
    Returns ``(..., joints, 3)`` metres and ``(..., joints, 4)`` unit quaternions.

    Raises SkeletonError when the shapes do not fit the skeleton.
    """
    joints, lead = len(skeleton), rotations.shape[:-2]
    if rotations.shape[-2:] != (joints, 4) or root.shape != (*lead, 3):
        raise SkeletonError(
            f"kinematics of {joints} joints need rotations (..., {joints}, 4) and a root (..., 3); "
            f"got {rotations.shape} and {root.shape}"
        )
    local = np.ascontiguousarray(rotations, dtype=np.float64).reshape(-1, joints, 4).view(np.complex128)
    start = np.asarray(root, dtype=np.float64).reshape(-1, 3)
    places, turned = np.empty((len(local), joints, 3)), np.empty_like(local)
    steps = _schedule(skeleton.parents.tobytes(), len(local) <= _SHORT)
    for first in range(0, len(local), _BLOCK):
        block = slice(first, first + _BLOCK)
        chain = local[block].transpose(1, 2, 0).copy()
        _multiply_along(steps, chain)
        turned[block] = chain.transpose(2, 0, 1)
        bones = _turned_offsets(chain[skeleton.parents], skeleton.offsets)
        bones[0] = start[block]  # whatever stood there: the root's parent is -1, the last joint
        for rows, above in steps:
            bones[rows] += bones[above]
        places[block] = bones.transpose(1, 0, 2)
    return places.reshape(*lead, joints, 3), turned.view(np.float64).reshape(*lead, joints, 4)


def local_from_global(skeleton: Skeleton, orientations: np.ndarray) -> np.ndarray:
    """``(..., joints, 4)`` local rotations that give these world orientations ``(..., joints, 4)``."""
    local = np.array(orientations, dtype=np.float64)
    above = local.take(skeleton.parents[1:], axis=-2)
    local[..., 1:, :] = rotation.multiply(rotation.conjugate(above), local[..., 1:, :])
    return local


def levels(parents: np.ndarray) -> Steps:
    """Per level of the tree below the root: its joints and their parents.

    parents: ``(joints,)``, -1 for roots, of which there may be many (a forest), and parents first.
    """
    depth, above = np.zeros(len(parents), dtype=np.int64), parents
    while (below := above >= 0).any():
        depth += below
        above = np.where(below, parents[above], -1)
    rows = [np.flatnonzero(depth == level) for level in range(1, depth.max(initial=0) + 1)]
    return tuple((joints, parents[joints]) for joints in rows)


def doublings(parents: np.ndarray) -> Steps:
    """Step k: the joints that have an ancestor 2^k generations up, and these ancestors."""
    steps, above = [], np.array(parents)
    while (rows := np.flatnonzero(above >= 0)).size:
        steps.append((rows, above[rows]))
        above = np.where(above >= 0, above[above], -1)
    return tuple(steps)


@lru_cache(maxsize=1024)
def _schedule(parents: bytes, short: bool) -> Steps:
    tree = np.frombuffer(parents, dtype=np.int64)
    return doublings(tree) if short else levels(tree)


def _multiply_along(steps: Steps, chain: np.ndarray) -> None:
    """From local to global orientations in place; chain is ``(joints, 2, frames)`` complex."""
    for rows, above in steps:
        left, right = chain.take(above, 0), chain.take(rows, 0)
        # (a + b j)(c + d j) = (a c - b d*) + (a d + b c*) j
        crossed = right[:, ::-1].conj()
        crossed[:, 0] *= -1
        crossed *= left[:, 1:]
        right *= left[:, :1]
        right += crossed
        chain[rows] = right


def _turned_offsets(above: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """``(joints, frames, 3)``: the offsets ``(joints, 3)`` turned by ``(joints, 2, frames)`` complex.

    For q = a + b j and an offset (x, c) with c = y + zi the turned offset is
    x' = (|a|^2 - |b|^2) x + 2 Im(a b* c) and c' = a^2 c + b^2 c* - 2i a b x.
    """
    a, b = above[:, 0], above[:, 1]
    x, c = offsets[:, :1], offsets[:, 1:].copy().view(np.complex128)
    out = np.empty((*a.shape, 3))
    mixed = b.conj()
    mixed *= a
    mixed *= c
    out[..., 0] = (a.real**2 + a.imag**2 - b.real**2 - b.imag**2) * x + 2 * mixed.imag
    across = a * b
    across *= -2j * x
    across += a * a * c
    across += b * b * c.conj()
    out[..., 1], out[..., 2] = across.real, across.imag
    return out
