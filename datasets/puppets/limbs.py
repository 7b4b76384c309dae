"""Two-bone limbs and the rotations they need, as 3x3 matrices over frames."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np


@dataclass(frozen=True, eq=False)
class Limb:
    """A limb drawn straight in the T-pose.

    bone:  (3,) unit, along the straight limb. hinge: (3,) unit, the axis about which the outer bone
           turns forward (arm) or backward (leg) when the middle joint bends.
    upper, lower: metres.
    ease, natural: (3,) unit, in the frame the limb hangs on: a direction of easy reach, and the hinge
           that feels natural there. Elsewhere the hinge is carried along by the shortest turn, which is
           smooth in every direction but the one opposite to ``ease``.
    tightest: of the angle between the bones, radians (0 would be folded flat).
    exact: share of its length within which goals are met exactly.
    """

    bone: np.ndarray
    hinge: np.ndarray
    upper: float
    lower: float
    ease: np.ndarray
    natural: np.ndarray
    tightest: float
    exact: float

    @property
    def longest(self) -> float:
        return self.upper + self.lower

    @property
    def shortest(self) -> float:
        """Distance between its ends when bent as far as it goes."""
        a, b = self.upper, self.lower
        return float(np.sqrt(a * a + b * b - 2.0 * a * b * np.cos(self.tightest)))


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
    """``v`` turned by the shortest turn from one unit vector to another; undefined only for opposites."""
    cosine, along, ahead = dot(start, end), dot(start, v), dot(end, v)
    share = 1.0 / np.maximum(1.0 + cosine, 1e-3)
    # v + axis x v + axis x (axis x v) / (1 + cosine), with the products written out
    forward = along + share * (cosine * along - ahead)
    back = ahead + share * (along - cosine * ahead)
    return v + forward * end - back * start


def apply(turn: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Vectors ``(..., 3)`` turned by matrices ``(..., 3, 3)``."""
    return np.asarray(np.einsum("...ij,...j->...i", turn, v))


def rotated(turn: np.ndarray, v: np.ndarray) -> np.ndarray:
    """One vector ``(3,)`` turned by matrices ``(..., 3, 3)``, as one product."""
    return np.asarray((turn.reshape(-1, 3) @ v).reshape(turn.shape[:-1]))


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
    """Matrices from rotation vectors ``(..., 3)`` (Rodrigues, with series near zero)."""
    square = (v * v).sum(axis=-1)
    angle = np.sqrt(square)
    small = square < 1e-8
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 1.0 - square / 6.0, np.sin(safe) / safe)
    second = np.where(small, 0.5 - square / 24.0, (1.0 - np.cos(safe)) / (safe * safe))
    turn = (second[..., None] * v)[..., :, None] * v[..., None, :]
    flat = turn.reshape(-1, 9)
    flat += (first[..., None] * v).reshape(-1, 3) @ _SKEW
    flat[:, ::4] += (1.0 - second * square).reshape(-1, 1)
    return turn


_CYCLES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
_SKEW = np.cross(np.eye(3)[:, None], np.eye(3)).swapaxes(1, 2).reshape(3, 9)
"""Vector to the nine numbers of the matrix that multiplies by it, as in a vector product."""


def to_vector(turn: np.ndarray) -> np.ndarray:
    """Rotation vectors ``(..., 3)`` of matrices whose angle stays clear of 180 degrees."""
    axis = np.empty(turn.shape[:-1])
    for i, j, k in _CYCLES:
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


def align(bone: np.ndarray, hinge: np.ndarray, to: np.ndarray, about_: np.ndarray) -> np.ndarray:
    """Matrices taking the pair of orthogonal unit vectors (bone, hinge) to (to, about_) ``(frames, 3)``."""
    before = np.stack([bone, hinge, cross(bone, hinge)], axis=-1)
    after = np.stack([to, about_, cross(to, about_)], axis=-1)
    return after @ before.T


def bend(
    limb: Limb, start: np.ndarray, goal: np.ndarray, frame: np.ndarray, swivel: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """World orientations ``(frames, 3, 3)`` of one limb's two bones: ``bend_all`` of one."""
    (upper,), (lower,) = bend_all((limb,), start[None], goal[None], frame, swivel[None])
    return upper, lower


def bend_all(
    limbs: tuple[Limb, ...],
    start: np.ndarray,
    goal: np.ndarray,
    frame: np.ndarray,
    swivel: np.ndarray,
    pole: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """World orientations ``(limbs, frames, 3, 3)`` of the two bones of limbs, against the T-pose.

    limbs: as long as each other, of one or both sides, solved at once.
    start, goal: ``(limbs, frames, 3)`` of a limb's two ends; frame: ``(frames, 3, 3)`` of what all hang
    on; swivel: ``(limbs, frames)`` turns the middle joint about the line between the ends, left-handed
    for +1. pole: places ``(limbs, frames, 3)`` towards which the middle joint points, and how far
    ``(limbs, frames)``.
    Goals within ``limb.exact`` are met exactly, those farther are neared ever more slowly.
    """
    limb = limbs[0]
    line = goal - start
    distance = length(line)
    to = line / np.maximum(distance, 1e-12)[..., None]
    hung, drawn = _drawn(limbs)
    ease, natural = (hung @ frame.reshape(-1, 3).T).reshape(2, *line.shape)
    hinge = carry(ease, to, natural)
    hinge = unit(hinge - to * dot(hinge, to))
    # along the limb, about its hinge, and where its middle joint is pushed: three orthogonal directions
    aside = cross(to, hinge)
    c, s = np.cos(swivel)[..., None], np.sin(swivel)[..., None]
    hinge, aside = c * hinge + s * aside, c * aside - s * hinge
    if pole is not None:
        away = pole[0] - start
        wanted = cross(unit(away - to * dot(away, to)), to)
        hinge = hinge + pole[1][..., None] * (wanted - hinge)
        hinge = unit(hinge - to * dot(hinge, to))
        aside = cross(to, hinge)
    d = _within(distance, limb)
    a, b = limb.upper, limb.lower
    cosine = np.clip((a * a + d * d - b * b) / (2.0 * a * d), -1.0, 1.0)
    sine = np.sqrt(1.0 - cosine * cosine)
    # both bones, one after the other, in the plane of ``to`` and ``aside``
    c = np.stack([cosine, (d - a * cosine) / b])[..., None]
    s = np.stack([sine, -a / b * sine])[..., None]
    turned = np.empty((2, *line.shape, 3))
    turned[..., 0] = c * to + s * aside
    turned[..., 1] = hinge
    turned[..., 2] = c * aside - s * to
    upper, lower = (turned.reshape(2, len(limbs), -1, 3) @ drawn).reshape(turned.shape)
    return upper, lower


@cache
def _drawn(limbs: tuple[Limb, ...]) -> tuple[np.ndarray, np.ndarray]:
    """``(2 limbs, 3)``: all directions of easy reach, then all natural hinges; and ``(limbs, 3, 3)``: bone,
    hinge and what is orthogonal to both, as rows."""
    hung = np.stack([*(limb.ease for limb in limbs), *(limb.natural for limb in limbs)])
    return hung, np.stack([[limb.bone, limb.hinge, cross(limb.bone, limb.hinge)] for limb in limbs])


def _within(distance: np.ndarray, limb: Limb) -> np.ndarray:
    """The distance that the limb makes: unchanged in reach, eased towards its limits beyond."""
    far, end = limb.exact * limb.longest, (0.15 * limb.exact + 0.85) * limb.longest
    near, stop = 1.06 * limb.shortest, limb.shortest
    out = np.maximum(distance - far, 0.0)
    inward = np.maximum(near - distance, 0.0)
    eased = np.clip(distance, near, far)
    eased = eased + (end - far) * (1.0 - np.exp(-out / (end - far)))
    return eased - (near - stop) * (1.0 - np.exp(-inward / (near - stop)))
