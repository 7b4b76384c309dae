"""Rotations as unit quaternions ``(..., 4)``, w first: the same functions for arrays and tensors.

Every function takes NumPy arrays or torch tensors (one kind per call), broadcasts over the leading axes
and returns the same kind. torch is never imported here: a tensor brings its module along. With tensors
every function has finite gradients everywhere, at the identity and at half turns too; where the true
derivative does not exist, the gradient is 0 or that of one of the equally good answers.

A quaternion and its negative are the same rotation. ``multiply(a, b)`` applies b first, then a, and the
chain of a skeleton is ``global = multiply(global of the parent, local)``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from retarget_bench.errors import BenchError

if TYPE_CHECKING:
    from torch import Tensor

Array = TypeVar("Array", np.ndarray, "Tensor")

_AXES = {"X": 0, "Y": 1, "Z": 2}
_SMALL = 1e-6
"""Squared angles below this use a series: its first left-out term is below 1e-18."""
_BLOCK = 1024
"""Frames of a block of ``in_blocks``."""


# ---------------------------------------------------------------------------------------- the algebra
def identity(*shape: int) -> np.ndarray:
    """``(*shape, 4)`` quaternions that turn nothing."""
    out = np.zeros((*shape, 4))
    out[..., 0] = 1.0
    return out


def conjugate(q: Array) -> Array:
    """``(..., 4)`` the inverse rotation of a unit quaternion."""
    w, x, y, z = _parts(q)
    return _join(q, w, -x, -y, -z)


def mirrored(q: Array) -> Array:
    """``(..., 4)`` the rotation in a mirror across X."""
    w, x, y, z = _parts(q)
    return _join(q, w, x, -y, -z)


def multiply(a: Array, b: Array) -> Array:
    """``(..., 4)`` b, then a (Hamilton's product)."""
    if isinstance(a, np.ndarray):
        return _multiply_as_complex(a, b)
    aw, ax, ay, az = _parts(a)
    bw, bx, by, bz = _parts(b)
    return _join(
        a,
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def rotate(q: Array, v: Array) -> Array:
    """``(..., 3)`` the vectors v ``(..., 3)`` turned by the unit quaternions q ``(..., 4)``."""
    w, x, y, z = _parts(q)
    vx, vy, vz = _parts(v)
    # v + w t + u x t with u = (x, y, z) and t = 2 u x v: fewer products than q v q*
    tx, ty, tz = (2 * part for part in _cross(x, y, z, vx, vy, vz))
    sx, sy, sz = _cross(x, y, z, tx, ty, tz)
    return _join(q, vx + w * tx + sx, vy + w * ty + sy, vz + w * tz + sz)


def normalise(q: Array) -> Array:
    """``(..., 4)`` made unit. Zero, which has no direction, becomes the identity."""
    length, short = _length(q)
    w, x, y, z = _parts(q)
    return _join(q, w / length + short, x / length, y / length, z / length)


def where(condition: Array, a: Array, b: Array) -> Array:
    """``(..., 4)`` a where ``condition`` ``(...)`` is True, b elsewhere."""
    chosen: Array = _ops(a).where(condition[..., None], a, b)
    return chosen


def stacked(parts: Sequence[Array]) -> Array:
    """``(..., joints, 4)`` from one ``(..., 4)`` per joint."""
    both: Array = _ops(parts[0]).stack(parts, axis=-2)
    return both


def continuous(q: Array, axis: int = 0) -> Array:
    """``(..., 4)`` the same rotations with signs chosen so that neighbours along ``axis`` are close."""
    ops = _ops(q)
    axis %= q.ndim
    before, after, first = (
        q[(slice(None),) * axis + (part,)] for part in (slice(-1), slice(1, None), slice(1))
    )
    dots = _dot(before, after)[..., None]
    ones = ops.ones_like(dots)
    flips = ops.concatenate([ops.ones_like(first[..., :1]), ops.where(dots < 0, -ones, ones)], axis=axis)
    signed: Array = q * ops.cumprod(flips, axis=axis)
    return signed


# ------------------------------------------------------------------------------- distances and blends
def angle(a: Array, b: Array) -> Array:
    """``(...)`` radians in [0, pi] between two orientations: the geodesic distance on SO(3)."""
    ops = _ops(a)
    w, x, y, z = _parts(multiply(conjugate(a), b))
    distance: Array = 2 * ops.arctan2(_root(x * x + y * y + z * z), abs(w))
    return distance


def slerp(a: Array, b: Array, t: Array | float) -> Array:
    """``(..., 4)`` the orientation at share t of the shortest way from a (t = 0) to b (t = 1).

    t: a number, or ``(...)``, broadcast against the leading axes of a and b.
    """
    share = t if isinstance(t, int | float) else t[..., None]
    return multiply(a, from_rotation_vector(share * to_rotation_vector(multiply(conjugate(a), b))))


def about(axis: Array, angle: Array | float) -> Array:
    """``(..., 4)`` the turn by ``angle`` ``(...)`` radians about the vectors ``axis`` ``(..., 3)``."""
    turn = angle if isinstance(angle, int | float) else angle[..., None]
    return from_rotation_vector(_direction(axis) * turn)


def between(u: Array, v: Array) -> Array:
    """``(..., 4)`` the shortest turn that brings the direction of u onto that of v, both ``(..., 3)``.

    For opposite vectors it is a half turn about some axis across u; for a zero vector the identity.
    """
    ops = _ops(u)
    u, v = _direction(u), _direction(v)
    # with h = u + v: (|h|^2 / 2, u x h) = (1 + u.v, u x v), but exact where u and v nearly cancel
    hx, hy, hz = _parts(u + v)
    ux, uy, uz = _parts(u + 0 * v)
    square = hx * hx + hy * hy + hz * hz
    opposite = square < (64 * ops.finfo(square.dtype).eps) ** 2
    cross = _cross(ux, uy, uz, hx, hy, hz)
    # any axis across u: u x (the coordinate axis that it leans to least)
    least_x = (abs(ux) <= abs(uy)) & (abs(ux) <= abs(uz))
    least_y = ~least_x & (abs(uy) <= abs(uz))
    one, none = ops.ones_like(ux), ops.zeros_like(ux)
    least = (
        ops.where(least_x, one, none),
        ops.where(least_y, one, none),
        ops.where(least_x | least_y, none, one),
    )
    across = _cross(ux, uy, uz, *least)
    axis = (ops.where(opposite, other, part) for other, part in zip(across, cross, strict=True))
    return normalise(_join(u, ops.where(opposite, none, square / 2), *axis))


# ---------------------------------------------------------------------------------- other descriptions
def from_rotation_vector(v: Array) -> Array:
    """``(..., 4)`` from axis times angle ``(..., 3)``, radians (the exponential map)."""
    ops = _ops(v)
    x, y, z = _parts(v)
    square = x * x + y * y + z * z
    small = square < _SMALL
    length = ops.sqrt(ops.where(small, ops.ones_like(square), square))
    w = ops.where(small, 1 - square / 8 + square * square / 384, ops.cos(length / 2))
    scale = ops.where(small, 0.5 - square / 48 + square * square / 3840, ops.sin(length / 2) / length)
    return _join(v, w, scale * x, scale * y, scale * z)


def to_rotation_vector(q: Array) -> Array:
    """``(..., 3)`` axis times angle in [0, pi] radians (the logarithm)."""
    ops = _ops(q)
    w, x, y, z = _parts(q)
    sine = x * x + y * y + z * z
    small = sine < _SMALL * w * w
    one = ops.ones_like(sine)
    length = ops.sqrt(ops.where(small, one, sine))
    safe_w = ops.where(small, w, one)
    ratio = ops.where(small, sine, 0 * one) / (safe_w * safe_w)
    series = (2 - ratio * (2 / 3) + ratio * ratio * (2 / 5)) / safe_w
    sign = ops.where(w < 0, -one, one)
    scale = ops.where(small, series, 2 * sign * ops.arctan2(length, sign * w) / length)
    return _join(q, scale * x, scale * y, scale * z)


def in_blocks(convert: Callable[..., np.ndarray], *arrays: np.ndarray) -> np.ndarray:
    """``convert`` of long arrays, equally long along their first axis, a block at a time: what it holds on
    the way is that of a block, which of ten minutes of motion is a hundred megabytes less."""
    length = len(arrays[0])
    first = convert(*(array[:_BLOCK] for array in arrays))
    out = np.empty((length, *first.shape[1:]), first.dtype)
    out[:_BLOCK] = first
    for at in range(_BLOCK, length, _BLOCK):
        out[at : at + _BLOCK] = convert(*(array[at : at + _BLOCK] for array in arrays))
    return out


def from_matrix(m: Array) -> Array:
    """``(..., 4)`` with w >= 0 or nearly so, from rotation matrices ``(..., 3, 3)``.

    Each row of 4 q q^T is the quaternion up to scale; the row with the largest diagonal is never small.
    """
    ops = _ops(m)
    (a, b, c), (d, e, f), (g, h, i) = ([m[..., r, s] for s in range(3)] for r in range(3))
    rows = (
        (1 + a + e + i, h - f, c - g, d - b),
        (h - f, 1 + a - e - i, b + d, c + g),
        (c - g, b + d, 1 - a + e - i, f + h),
        (d - b, c + g, f + h, 1 - a - e + i),
    )
    best, largest = list(rows[0]), rows[0][0]
    for k in (1, 2, 3):
        better = rows[k][k] > largest
        best = [ops.where(better, new, old) for new, old in zip(rows[k], best, strict=True)]
        largest = ops.where(better, rows[k][k], largest)
    q = normalise(_join(m, *best))
    signed: Array = ops.where(q[..., :1] < 0, -q, q)
    return signed


def to_matrix(q: Array) -> Array:
    """``(..., 3, 3)`` rotation matrices of unit quaternions: ``matrix @ v == rotate(q, v)``."""
    w, x, y, z = _parts(q)
    x2, y2, z2 = 2 * x, 2 * y, 2 * z
    xx, yy, zz = x * x2, y * y2, z * z2
    xy, xz, yz = x * y2, x * z2, y * z2
    wx, wy, wz = w * x2, w * y2, w * z2
    flat = _join(
        q, 1 - yy - zz, xy - wz, xz + wy, xy + wz, 1 - xx - zz, yz - wx, xz - wy, yz + wx, 1 - xx - yy
    )
    matrix: Array = flat.reshape(*q.shape[:-1], 3, 3)
    return matrix


def from_euler(angles: Array, order: str) -> Array:
    """``(..., 4)`` from Euler angles ``(..., 3)`` in radians.

    order: three of X, Y, Z without neighbours alike, as a BVH file lists its channels: ``ZXY`` turns about
    Z, then about the turned X, then about the twice turned Y (intrinsic): q = q_Z q_X q_Y.
    """
    ops = _ops(angles)
    first, second, third = _order(order)
    half = angles / 2
    (c1, c2, c3), (s1, s2, s3) = _parts(ops.cos(half)), _parts(ops.sin(half))
    left = 3 - first - second  # the axis across the first two: e_first e_second = +- e_left
    v = {first: s1 * c2, second: c1 * s2, left: s1 * s2 if _cyclic(first, second) else -s1 * s2}
    i, j, k = third, (third + 1) % 3, (third + 2) % 3
    w, v = (
        c1 * c2 * c3 - v[i] * s3,
        {
            i: v[i] * c3 + c1 * c2 * s3,
            j: v[j] * c3 + v[k] * s3,
            k: v[k] * c3 - v[j] * s3,
        },
    )
    return _join(angles, w, v[0], v[1], v[2])


def to_euler(q: Array, order: str) -> Array:
    """``(..., 3)`` Euler angles in radians, ``order`` as in ``from_euler``.

    The middle angle lies in [-pi/2, pi/2] (in [0, pi] for orders such as ZXZ), the others in (-pi, pi].
    At gimbal lock the angles are not unique; those returned still give the same rotation.
    Half angles by Bernardes and Viollet, Quaternion to Euler angles conversion, PLoS ONE 17(11), 2022.
    """
    ops = _ops(q)
    third, second, first = _order(order)  # the same turn about fixed axes has them in reverse
    repeats = first == third
    last = 3 - first - second if repeats else third
    sign = 1.0 if _cyclic(first, second) else -1.0
    w, *v = _parts(q)
    a, b, c, d = w, v[first], v[second], v[last] * sign
    if not repeats:
        a, b, c, d = a - c, b + d, c + a, d - b
    middle = 2 * ops.arctan2(_root(c * c + d * d), _root(a * a + b * b))
    plus, minus = _heading(b, a), _heading(d, c)
    outer, inner = plus - minus, plus + minus
    if not repeats:
        middle, inner = middle - np.pi / 2, inner * sign
    wrapped = [x - 2 * np.pi * ops.ceil(x / (2 * np.pi) - 0.5) for x in (inner, outer)]
    return _join(q, wrapped[0], middle, wrapped[1])


# --------------------------------------------------------------------------------------------- helpers
def _ops(array: Any) -> Any:
    """The module whose functions fit the array: numpy, or the torch that made the tensor."""
    return np if isinstance(array, np.ndarray | np.generic) else sys.modules["torch"]


def _parts(array: Any) -> tuple[Any, ...]:
    """The components along the last axis."""
    return tuple(array[..., k] for k in range(array.shape[-1]))


def _join(like: Array, *parts: Any) -> Array:
    """Components back into one last axis, broadcast against each other; the kind is that of ``like``."""
    joined: Array
    if isinstance(like, np.ndarray):
        shape: tuple[int, ...] = np.broadcast_shapes(*(part.shape for part in parts))
        joined = np.empty((*shape, len(parts)), np.result_type(*parts))
        for k, part in enumerate(parts):
            joined[..., k] = part
    else:
        torch = _ops(like)
        joined = torch.stack(torch.broadcast_tensors(*parts), -1)
    return joined


def _multiply_as_complex(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Hamilton's product on pairs of complex numbers, w + xi and y + zi, that share the arrays' memory.

    A quarter of the array operations; on short clips these, not the numbers, are what takes time.
    """
    (p, q), (r, s) = _parts(_as_complex(a)), _parts(_as_complex(b))
    out = np.empty((*np.broadcast_shapes(p.shape, r.shape), 2), np.complex128)
    out[..., 0] = p * r - q * s.conj()
    out[..., 1] = p * s + q * r.conj()
    return out.view(np.float64)


def _as_complex(q: np.ndarray) -> np.ndarray:
    """``(..., 2)`` complex, without a copy where the memory allows."""
    q = np.asarray(q, dtype=np.float64)
    return (q if q.strides[-1] == q.itemsize else np.ascontiguousarray(q)).view(np.complex128)


def _cross(ax: Any, ay: Any, az: Any, bx: Any, by: Any, bz: Any) -> tuple[Any, Any, Any]:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def _root(square: Any) -> Any:
    """The square root, with gradient 0 instead of infinity at 0."""
    ops = _ops(square)
    zero = square == 0
    return ops.where(zero, ops.zeros_like(square), ops.sqrt(ops.where(zero, ops.ones_like(square), square)))


def _heading(y: Any, x: Any) -> Any:
    """arctan2, with a finite gradient at the origin, where it is 0."""
    ops = _ops(y)
    square = 1.0 * (x * x + y * y)
    zero = square < ops.finfo(square.dtype).tiny
    return ops.arctan2(y, ops.where(zero, ops.ones_like(x), x))


def _length(v: Any) -> tuple[Any, Any]:
    """``(...)`` the length over the last axis, and where it is too short to tell a direction.

    There, below 1e-14 in single and 1e-115 in double precision, the length is given as 1.
    """
    ops = _ops(v)
    square = 1.0 * sum(part * part for part in _parts(v))
    short = square < ops.finfo(square.dtype).tiny ** 0.75
    return ops.sqrt(ops.where(short, ops.ones_like(square), square)), short


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors ``(..., n)`` made 1 long; those of no length stay zero."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


def _dot(a: Array, b: Array) -> Array:
    """``(...)`` the sum of products over the last axis, without an array of all products."""
    dot: Array = sum(one * other for one, other in zip(_parts(a), _parts(b), strict=True))
    return dot


def _direction(v: Array) -> Array:
    """``(..., 3)`` of length 1; zero stays zero."""
    length, short = _length(v)
    unit: Array = v / length[..., None] * ~short[..., None]
    return unit


def _cyclic(first: int, second: int) -> bool:
    """True if the second axis follows the first in X, Y, Z, X."""
    return (second - first) % 3 == 1


def _order(order: str) -> tuple[int, int, int]:
    axes = tuple(_AXES.get(letter, -1) for letter in order.upper())
    if len(axes) != 3 or -1 in axes or axes[0] == axes[1] or axes[1] == axes[2]:
        raise BenchError(
            f"rotation order {order!r}: three of X, Y, Z are needed, neighbours different (ZXY)"
        )
    return axes[0], axes[1], axes[2]
