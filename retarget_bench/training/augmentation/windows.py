"""Windows of motion by several bodies at once, and the changes that augmentation makes to them.

The joints of all bodies lie side by side, as those of one forest, so that each change is a few operations
on whole arrays, however the bodies differ. A quaternion w + xi + yj + zk is computed with as two complex
numbers, w + xi and y + zi, as in ``motion/kinematics.py``; each in a plane of its own and in single
precision, products are twenty times as fast as those of ``rotation.py``.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Motion
from retarget_bench.motion.kinematics import levels
from retarget_bench.motion.roles import BODY_PARTS
from retarget_bench.training.augmentation.body import AugmentedBody


@dataclass(frozen=True, eq=False)
class MotionWindows:
    """Motion of bodies side by side; ``joints`` counts those of all of them.

    bodies:    of each row.
    rotations: ``(2, joints, frames)`` complex, local, in aligned form.
    root:      ``(rows, frames, 3)`` metres, the place of each body's root joint.
    """

    bodies: Sequence[AugmentedBody]
    rotations: np.ndarray
    root: np.ndarray

    @cached_property
    def first(self) -> np.ndarray:
        """``(rows + 1,)`` the number of each row's first joint; last, that of all joints."""
        return np.cumsum([0, *(len(body.parents) for body in self.bodies)])

    @cached_property
    def rows(self) -> np.ndarray:
        """``(joints,)`` the row of each joint."""
        return np.repeat(np.arange(len(self.bodies)), np.diff(self.first))

    def motion(self, row: int, frames: int, fps: float) -> Motion:
        """The first frames of a row, as its character performs them."""
        joints = slice(*self.first[row : row + 2])
        local = as_quaternions(self._local[:, joints, :frames])
        return self.bodies[row].character.motion(local, self.root[row, :frames], fps)

    @cached_property
    def _local(self) -> np.ndarray:
        """``(2, joints, frames)`` rotations as the skeletons have them."""
        above = rotation.conjugate(np.concatenate([body.above for body in self.bodies]))
        own = np.concatenate([body.own for body in self.bodies])
        return _multiply(_multiply(as_planes(above[None]), self.rotations), as_planes(own[None]))

    # --------------------------------------------------------------------------------------- changes
    def exchanged(self, partners: np.ndarray, parts: np.ndarray) -> Self:
        """Body parts turn as those of other rows do, so far as both have joints of the same roles there.

        partners: ``(rows,)``. parts: ``(rows, BODY_PARTS)`` bool, which are taken over from the partner.
        """
        order = np.arange(len(self.rows))
        for row, part in np.argwhere(parts).tolist():
            partner, name = int(partners[row]), BODY_PARTS[part]
            own, other = (self.bodies[each].limbs.get(name) for each in (row, partner))
            if own is not None and other is not None and own[0] == other[0]:
                order[self.first[row] + own[1]] = self.first[partner] + other[1]
        return replace(self, rotations=self.rotations[:, order])

    @cached_property
    def links(self) -> np.ndarray:
        """``(chains,)`` how many joints each chain of all rows has."""
        return np.concatenate([body.links for body in self.bodies])

    @cached_property
    def chains(self) -> np.ndarray:
        """``(joints,)`` the number, in all rows, of the chain that each joint turns with, or -1."""
        counts = np.cumsum([0, *(len(body.links) for body in self.bodies)])
        chains = np.concatenate([body.chains for body in self.bodies])
        return np.where(chains >= 0, chains + counts[self.rows], -1)

    def turned(self, chains: np.ndarray, vectors: np.ndarray) -> Self:
        """Chains turned about the axes of what they hang from, each of its joints by its part of the turn.

        chains: ``(n,)`` increasing. vectors: ``(frames, n, 3)`` of the whole turns, axis times radians.
        """
        joints = np.flatnonzero(np.isin(self.chains, chains))
        which = np.searchsorted(chains, self.chains[joints])
        turns = as_planes(rotation.from_rotation_vector(vectors / self.links[chains][:, None]))
        rotations = self.rotations.copy()
        rotations[:, joints] = _multiply(turns[:, which], rotations[:, joints])
        return replace(self, rotations=rotations)

    def mirrored(self, rows: np.ndarray) -> Self:
        """Mirror images, left and right exchanged, in the rows ``(n,)``, whose bodies have one."""
        order = np.arange(len(self.rows))
        for row in rows.tolist():
            order[slice(*self.first[row : row + 2])] = self.first[row] + self.bodies[row].mirror
        rotations, root = self.rotations[:, order], self.root.copy()
        # in the mirror, what turns about an axis in its plane turns the other way round
        rotations[1, np.isin(self.rows, rows)] *= -1.0
        root[rows, :, 0] *= -1.0
        return replace(self, rotations=rotations, root=root)

    def veered(self, angles: np.ndarray) -> Self:
        """Each body turned about the vertical axis by ``angles`` ``(rows, frames)`` radians, and every step
        of its path by the mean of the angles before and after."""
        half = (0.5 * angles).astype(np.float32)
        rotations, roots = self.rotations.copy(), self.first[:-1]
        turns = np.stack([np.cos(half), np.sin(half)]).astype(np.complex64)
        rotations[:, roots] = _multiply(turns, rotations[:, roots])
        steps = np.diff(self.root, axis=1)
        between = 0.5 * (angles[:, 1:] + angles[:, :-1])
        cos, sin = np.cos(between), np.sin(between)
        x, y, z = steps[..., 0], steps[..., 1], steps[..., 2]
        turned = np.stack([x * cos + z * sin, y, z * cos - x * sin], axis=-1)
        root = np.concatenate([self.root[:, :1], self.root[:, :1] + np.cumsum(turned, axis=1)], axis=1)
        return replace(self, rotations=rotations, root=root)

    def as_low_as(self, other: Self) -> Self:
        """Moved up or down such that in every frame a row's lowest joint is as high as in ``other``."""
        root = self.root.copy()
        root[..., 1] += other.lowest - self.lowest
        return replace(self, root=root)

    @cached_property
    def lowest(self) -> np.ndarray:
        """``(rows, frames)`` metres: the height of the lowest joint."""
        parents = np.concatenate([body.parents for body in self.bodies])
        parents = np.where(parents >= 0, parents + self.first[self.rows], -1)
        offsets = np.concatenate([body.offsets for body in self.bodies])
        turned, heights = self.rotations.copy(), np.zeros(self.rotations.shape[1:], np.float32)
        for joints, above in levels(parents):
            high = turned[:, above]
            heights[joints] = heights[above] + _rise(high, offsets[joints])
            turned[:, joints] = _multiply(high, turned[:, joints])
        return np.asarray(np.minimum.reduceat(heights, self.first[:-1], axis=0) + self.root[..., 1])


def side_by_side(
    bodies: Sequence[AugmentedBody], windows: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]
) -> MotionWindows:
    """Windows of clips, of equally many frames, which may lie between those of the clip.

    windows: of each row the rotations ``(frames of the clip, joints, 4)`` in aligned form, with signs
    continuous along time, and the root ``(frames of the clip, 3)``; and when in the clip each frame is,
    ``(frames,)`` in frames from its first. Between frames of a clip at 30 frames per second the straight
    way, made unit, is as good as slerp: at a turn of 600 degrees a second it is 0.03 degrees beside it.
    """
    times = np.stack([at for *_, at in windows])
    lows = times.astype(np.int64)
    shares = (times - lows).astype(np.float32)

    def read(rows: Sequence[int], later: int) -> tuple[np.ndarray, np.ndarray]:
        frames = [np.minimum(lows[row] + later, len(windows[row][1]) - 1) for row in rows]
        some = [(*windows[row][:2], at) for row, at in zip(rows, frames, strict=True)]
        rotations = np.concatenate([rotations[at] for rotations, _, at in some], axis=1)
        return as_planes(rotations), np.stack([root[at] for _, root, at in some], dtype=np.float64)

    motion = MotionWindows(bodies, *read(range(len(windows)), 0))
    if len(between := np.flatnonzero(shares.any(axis=1))):
        rotations, root = read(between.tolist(), 1)
        joints = np.isin(motion.rows, between)
        before = motion.rotations[:, joints]
        motion.rotations[:, joints] = before + shares[motion.rows[joints]] * (rotations - before)
        motion.root[between] += shares[between, :, None] * (root - motion.root[between])
    length = np.sqrt((motion.rotations.real**2 + motion.rotations.imag**2).sum(0))
    return replace(motion, rotations=motion.rotations / length)


# ------------------------------------------------------------------------------------------- planes
def as_planes(quaternions: np.ndarray) -> np.ndarray:
    """``(2, joints, frames)`` complex of ``(frames, joints, 4)``."""
    pairs = np.ascontiguousarray(quaternions, np.float32).view(np.complex64)
    return np.ascontiguousarray(pairs.transpose(2, 1, 0))


def as_quaternions(planes: np.ndarray) -> np.ndarray:
    """The inverse of ``as_planes``."""
    return np.ascontiguousarray(planes.transpose(2, 1, 0)).view(np.float32)


def _multiply(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """``(2, joints, frames)`` right, then left: (a + bj)(c + dj) = (ac - bd*) + (ad + bc*)j."""
    (a, b), (c, d) = left, right
    out = np.empty(np.broadcast_shapes(left.shape, right.shape), right.dtype)
    np.multiply(a, c, out=out[0])
    np.multiply(a, d, out=out[1])
    out[0] -= b * d.conj()
    out[1] += b * c.conj()
    return out


def _rise(turned: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """``(joints, frames)`` the heights of offsets ``(joints, 3)`` that are turned: the real part of
    a²c + b²c* - 2iabx with c = y + zi."""
    a, b = turned
    x, y, z = offsets.astype(np.float32).T[..., None]
    squares, product = a * a, a * b
    other = b * b
    rise = (squares.real + other.real) * y - (squares.imag - other.imag) * z
    return np.asarray(rise + 2.0 * product.imag * x)
