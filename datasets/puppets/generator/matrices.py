"""Vectors and rotation matrices over frames.

The solver multiplies many matrices of a few hundred frames. With the engine's quaternions
(``retarget_bench.motion.rotation``) instead, ``about`` took 30 times as long, and ``to_vector`` made the
solver of people a fifth slower.
"""

import numpy as np

from retarget_bench.motion import rotation


def unit(v: np.ndarray) -> np.ndarray:
    """Vectors ``(..., 3)`` scaled to length 1 (a zero vector stays zero)."""
    return v / np.maximum(length(v), 1e-12)[..., None]


def length(v: np.ndarray) -> np.ndarray:
    """``(...)`` of vectors ``(..., 3)``"""
    return np.asarray(np.sqrt((v * v).sum(axis=-1)))


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``(..., 1)``"""
    return (a * b).sum(axis=-1, keepdims=True)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product of ``(..., 3)``, faster than ``np.cross``."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    # filled in: stacking takes longer than the arithmetic
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = ay * bz - az * by
    product[..., 1] = az * bx - ax * bz
    product[..., 2] = ax * by - ay * bx
    return product


def carry(start: np.ndarray, end: np.ndarray, v: np.ndarray) -> np.ndarray:
    """``v`` rotated by the shortest rotation from one unit vector to another; undefined only for
    opposites."""
    cosine, along, ahead = dot(start, end), dot(start, v), dot(end, v)
    share = 1.0 / np.maximum(1.0 + cosine, 1e-3)
    # v + axis x v + axis x (axis x v) / (1 + cosine), with the products written out
    forward = along + share * (cosine * along - ahead)
    back = ahead + share * (along - cosine * ahead)
    return v + forward * end - back * start


def rotated(turn: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Vectors ``(..., 3)``, or a single one, rotated by matrices ``(..., 3, 3)``."""
    if v.ndim == 1:
        return np.asarray((turn.reshape(-1, 3) @ v).reshape(turn.shape[:-1]))
    return np.asarray(np.einsum("...ij,...j->...i", turn, v))


def about(axis: int, angle: np.ndarray) -> np.ndarray:
    """Matrices ``(frames, 3, 3)`` turning about a coordinate axis by angles ``(frames,)``."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.zeros((*np.shape(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[..., axis, axis] = 1.0
    turn[..., i, i] = turn[..., j, j] = c
    turn[..., j, i], turn[..., i, j] = s, -s
    return turn


def from_vector(v: np.ndarray) -> np.ndarray:
    """Matrices from rotation vectors ``(..., 3)``."""
    return rotation.to_matrix(rotation.from_rotation_vector(v))


def to_vector(turn: np.ndarray) -> np.ndarray:
    """Rotation vectors ``(..., 3)`` of matrices whose angle stays clear of 180 degrees."""
    axis = np.empty(turn.shape[:-1])
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(turn[..., j, i], turn[..., i, j], out=axis[..., k])
    twice_sine = length(axis)
    trace = turn[..., 0, 0] + turn[..., 1, 1] + turn[..., 2, 2]
    angle = np.arctan2(twice_sine, trace - 1.0)
    small = twice_sine < 1e-6
    factor = np.where(small, 0.5, angle / np.where(small, 1.0, twice_sine))
    return axis * factor[..., None]


def part_way(a: np.ndarray, b: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Matrices ``(frames, 3, 3)`` on the shortest turn from ``a`` to ``b``, at shares ``(frames,)``."""
    return a @ from_vector(to_vector(np.swapaxes(a, -1, -2) @ b) * np.asarray(share)[..., None])
