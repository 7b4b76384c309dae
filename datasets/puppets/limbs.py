"""Two-bone limbs and the rotations they need, as 3x3 matrices over frames."""

from __future__ import annotations

from dataclasses import dataclass

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
    return v / np.maximum(np.sqrt((v * v).sum(axis=-1, keepdims=True)), 1e-12)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``(..., 1)``"""
    return (a * b).sum(axis=-1, keepdims=True)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product of ``(..., 3)``, faster than ``np.cross``."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def carry(start: np.ndarray, end: np.ndarray, v: np.ndarray) -> np.ndarray:
    """``v`` turned by the shortest turn from one unit vector to another; undefined only for opposites."""
    axis = cross(start, end)
    once = cross(axis, v)
    return v + once + cross(axis, once) / np.maximum(1.0 + dot(start, end), 1e-3)


def spin(v: np.ndarray, axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """``v`` turned about a unit axis by angles ``(frames,)`` (Rodrigues)."""
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    return v * c + cross(axis, v) * s + axis * dot(axis, v) * (1.0 - c)


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
    first = np.where(small, 1.0 - square / 6.0, np.sin(safe) / safe)[..., None, None]
    second = np.where(small, 0.5 - square / 24.0, (1.0 - np.cos(safe)) / (safe * safe))[..., None, None]
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    zero = np.zeros_like(x)
    skew = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*v.shape[:-1], 3, 3)
    return np.eye(3) + first * skew + second * (skew @ skew)


def to_vector(turn: np.ndarray) -> np.ndarray:
    """Rotation vectors ``(..., 3)`` of matrices whose angle stays clear of 180 degrees."""
    axis = np.stack(
        [
            turn[..., 2, 1] - turn[..., 1, 2],
            turn[..., 0, 2] - turn[..., 2, 0],
            turn[..., 1, 0] - turn[..., 0, 1],
        ],
        axis=-1,
    )
    twice_sine = np.sqrt((axis * axis).sum(axis=-1))
    angle = np.arctan2(twice_sine, np.trace(turn, axis1=-2, axis2=-1) - 1.0)
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
    limb: Limb,
    start: np.ndarray,
    goal: np.ndarray,
    frame: np.ndarray,
    swivel: np.ndarray,
    pole: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """World orientations ``(frames, 3, 3)`` of a limb's two bones, against the T-pose.

    start, goal: ``(frames, 3)`` of the limb's two ends; frame: ``(frames, 3, 3)`` of what it hangs on;
    swivel: ``(frames,)`` turns the middle joint about the line between the ends, left-handed for +1.
    pole: places ``(frames, 3)`` towards which the middle joint points, and how far ``(frames,)``.
    Goals within ``limb.exact`` are met exactly, those farther are neared ever more slowly.
    """
    line = goal - start
    distance = np.sqrt((line * line).sum(axis=-1))
    to = unit(line)
    ease, natural = frame @ limb.ease, frame @ limb.natural
    hinge = carry(ease, to, natural)
    hinge = unit(hinge - to * dot(hinge, to))
    hinge = spin(hinge, to, swivel)
    if pole is not None:
        aside = pole[0] - start
        wanted = cross(unit(aside - to * dot(aside, to)), to)
        hinge = hinge + pole[1][:, None] * (wanted - hinge)
        hinge = unit(hinge - to * dot(hinge, to))
    d = _within(distance, limb)
    a, b = limb.upper, limb.lower
    cosine = np.clip((a * a + d * d - b * b) / (2.0 * a * d), -1.0, 1.0)[:, None]
    sine = np.sqrt(1.0 - cosine * cosine)
    upper = cosine * to + sine * cross(to, hinge)
    lower = (to * d[:, None] - a * upper) / b
    return align(limb.bone, limb.hinge, upper, hinge), align(limb.bone, limb.hinge, lower, hinge)


def _within(distance: np.ndarray, limb: Limb) -> np.ndarray:
    """The distance that the limb makes: unchanged in reach, eased towards its limits beyond."""
    far, end = limb.exact * limb.longest, (0.15 * limb.exact + 0.85) * limb.longest
    near, stop = 1.06 * limb.shortest, limb.shortest
    out = np.maximum(distance - far, 0.0)
    inward = np.maximum(near - distance, 0.0)
    eased = np.clip(distance, near, far)
    eased = eased + (end - far) * (1.0 - np.exp(-out / (end - far)))
    return eased - (near - stop) * (1.0 - np.exp(-inward / (near - stop)))
