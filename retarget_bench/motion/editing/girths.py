"""How thick trunk and legs of a skinned body are around their bones, and how deep points are in them.

A radius for every height along a part and every direction around it, measured once on the skin. It moves
rigidly with the part's joint: a question of all frames is then a look-up, where one of the skin itself
would need its vertices in every frame.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Self

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.body import UP
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.penetration.limbs import moved_vertices
from retarget_bench.motion.roles import SIDES, chain

_HEIGHTS, _ROUND = 24, 72
"""Cells of a part, along it and around it."""
_SAMPLE, _LONG, _MOST = 0.01, 0.9, 12
"""Body heights between samples of the skin, on this share of its triangles; how often an edge is divided at
most."""
_POINT = 0.03
"""Body heights between the points of an arm that stand for its skin."""
_FEW = 8
"""Triangles that are too few for a part of a body."""


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a body around its bone, in the frame of a joint.

    middle: ``(3,)`` metres, of its skin. axes: ``(3, 3)`` unit rows: along it, and two across.
    ends:   metres along it, from the middle, where it begins and ends.
    radii:  ``(_HEIGHTS, _ROUND)`` metres from the line through the middle to the skin.
    """

    joint: int
    middle: np.ndarray
    axes: np.ndarray
    ends: tuple[float, float]
    radii: np.ndarray

    @classmethod
    def of(cls, joint: int, line: np.ndarray, samples: np.ndarray) -> Self:
        """The part of a joint along the unit vector ``line`` ``(3,)``, by samples ``(n, 3)`` of its skin;
        both in the joint's frame."""
        across = np.cross(line, np.eye(3)[np.abs(line).argmin()])
        across /= np.linalg.norm(across)
        axes = np.stack([line, across, np.cross(line, across)])
        middle = (samples.min(axis=0) + samples.max(axis=0)) / 2.0
        along, x, y = axes @ (samples - middle).T
        ends = (float(along.min()), float(along.max()))
        radii = np.full((_HEIGHTS, _ROUND), -1.0)
        height = (_HEIGHTS * (along - ends[0]) / max(ends[1] - ends[0], 1e-9)).astype(int)
        cells = height.clip(0, _HEIGHTS - 1), (_ROUND * np.arctan2(y, x) / (2 * np.pi)).astype(int) % _ROUND
        np.maximum.at(radii, cells, np.hypot(x, y))
        return cls(joint, middle, axes, ends, _filled(radii))

    @property
    def size(self) -> float:
        """Metres: no place of it is farther from its middle."""
        return float(np.hypot(self.radii.max(), np.abs(self.ends).max()))

    def may_hold(self, points: np.ndarray, margin: float) -> np.ndarray:
        """``(...)`` bool: points ``(..., 3)``, as of ``depth``, that are not clear of it by so many metres
        at first sight."""
        along, x, y = np.moveaxis(points, -1, 0)
        beside = x * x + y * y < (self.radii.max() + margin) ** 2
        return np.asarray(beside & (along > self.ends[0] - margin) & (along < self.ends[1] + margin))

    def depth(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``(...)`` metres by which points ``(..., 3)``, along ``axes`` from the middle, are inside,
        negative outside; and ``(..., 2)`` unit vectors across that lead out."""
        along, x, y = np.moveaxis(points, -1, 0)
        far = np.hypot(x, y)
        ends = np.minimum(along - self.ends[0], self.ends[1] - along)
        out = np.stack([x, y], axis=-1) / np.maximum(far, 1e-9)[..., None]
        return np.minimum(self._radius(along, x, y) - far, ends), out

    def _radius(self, along: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Between the middles of cells linear."""
        height = _HEIGHTS * (along - self.ends[0]) / max(self.ends[1] - self.ends[0], 1e-9) - 0.5
        height = height.clip(0.0, _HEIGHTS - 1.0)
        around = _ROUND * np.arctan2(y, x) / (2 * np.pi) - 0.5
        row, column = np.minimum(height.astype(int), _HEIGHTS - 2), np.floor(around).astype(int)
        up, on = height - row, around - column
        column, after = column % _ROUND, (column + 1) % _ROUND
        low = (1.0 - on) * self.radii[row, column] + on * self.radii[row, after]
        high = (1.0 - on) * self.radii[row + 1, column] + on * self.radii[row + 1, after]
        return np.asarray((1.0 - up) * low + up * high)


def _filled(radii: np.ndarray) -> np.ndarray:
    """Cells without a sample (-1) are as their neighbours."""
    while (radii < 0.0).any():
        above, below = np.vstack([radii[:1], radii[:-1]]), np.vstack([radii[1:], radii[-1:]])
        near = np.max([above, below, np.roll(radii, 1, axis=1), np.roll(radii, -1, axis=1)], axis=0)
        radii = np.where(radii < 0.0, near, radii)
    return radii


@lru_cache(maxsize=16)
def parts(body: Character) -> tuple[Part, ...]:
    """Trunk, thighs and shanks of a body; none without a mesh."""
    mesh = body.mesh
    if mesh is None or not len(mesh.faces):
        return ()
    places, turned = mesh.bound(body.skeleton)
    nearest = _with_part(body)[mesh.weights.argmax(axis=1)]
    found = []
    for joint, line in _lines(body).items():
        faces = mesh.faces[(nearest[mesh.faces] == joint).sum(axis=1) > 1]
        if len(faces) >= _FEW:
            back = rotation.conjugate(turned[joint])[None]
            samples = rotation.rotate(back, _samples(mesh, faces, _SAMPLE * body.height) - places[joint])
            local = rotation.rotate(rotation.conjugate(body.reference_globals[joint]), line)
            found.append(Part.of(joint, local, samples))
    return tuple(found)


def _lines(body: Character) -> dict[int, np.ndarray]:
    """Joint -> ``(3,)`` unit: the direction of its part in the reference pose."""
    trunk = [*body.joints(["hips"]), *chain(body.roles, "spine")]
    lines = dict.fromkeys(trunk, UP)
    for side in SIDES:
        leg = body.joints([f"{side}_{part}" for part in ("up_leg", "leg", "foot")])
        for upper, lower in pairwise(leg):
            line = body.reference_places[lower] - body.reference_places[upper]
            if (length := float(np.linalg.norm(line))) > 1e-9:
                lines[upper] = line / length
    return lines


def _with_part(body: Character) -> np.ndarray:
    """``(joints,)`` the nearest joint above, or itself, that has a role: helpers and twist bones belong to
    the bone that they are in."""
    nearest = np.arange(len(body.skeleton))
    for joint, parent in enumerate(body.skeleton.parents.tolist()):
        if body.roles[joint] is None and parent >= 0:
            nearest[joint] = nearest[parent]
    return nearest


def _samples(mesh: Mesh, faces: np.ndarray, apart: float) -> np.ndarray:
    """``(n, 3)`` points on triangles, no farther apart than ``apart`` metres where that needs few."""
    corners = mesh.vertices[faces]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(axis=1)
    divided = int(np.clip(np.ceil(np.quantile(edges, _LONG) / apart), 1, _MOST))
    grid = np.array([(i, j) for i in range(divided + 1) for j in range(divided + 1 - i)]) / divided
    shares = np.column_stack([grid, 1.0 - grid.sum(axis=1)])
    return np.asarray((shares @ corners).reshape(-1, 3))


@dataclass(frozen=True, eq=False)
class PosedParts:
    """The parts of a body in the frames of a motion.

    middles: ``(frames, parts, 3)`` metres. axes: ``(frames, parts, 3, 3)`` unit rows.
    """

    parts: tuple[Part, ...]
    middles: np.ndarray
    axes: np.ndarray

    @classmethod
    def of(cls, motion: Motion) -> Self:
        """That of a motion; no parts of a body without a mesh."""
        each = parts(motion.character)
        joints = [part.joint for part in each]
        turned = motion.global_rotations[:, joints]
        middles = rotation.rotate(turned, np.reshape([part.middle for part in each], (-1, 3)))
        axes = rotation.rotate(turned[:, :, None], np.reshape([part.axes for part in each], (-1, 3, 3)))
        return cls(each, motion.positions[:, joints] + middles, axes)

    def at(self, frames: np.ndarray) -> Self:
        """The chosen frames."""
        return replace(self, middles=self.middles[frames], axes=self.axes[frames])

    def deepest(
        self, points: np.ndarray, margin: np.ndarray | float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """``(frames,)`` metres by which the deepest of points ``(frames, n, 3)`` is inside, 0 where none
        is; and ``(frames, 3)`` the way out of all that are inside, the deeper the more.

        margin: metres that are added all around, or ``(frames,)``.
        """
        depth, way = np.zeros(len(points)), np.zeros((len(points), 3))
        added = np.broadcast_to(margin, depth.shape)
        most = float(added.max(initial=0.0))
        centre = points.mean(axis=1) if points.shape[1] else way
        size = np.linalg.norm(points - centre[:, None], axis=-1).max(initial=0.0) + most
        for number, part in enumerate(self.parts):
            apart = np.linalg.norm(centre - self.middles[:, number], axis=-1)
            some = np.flatnonzero(apart < part.size + size)
            axes = self.axes[some, number]
            local = (points[some] - self.middles[some, number, None]) @ axes.swapaxes(1, 2)
            frame, point = np.nonzero(part.may_hold(local, most))
            metres, out = part.depth(local[frame, point])
            metres += added[some[frame]]
            weighted = metres.clip(0.0)[:, None] * out
            np.maximum.at(depth, some[frame], metres)
            for axis in range(3):
                outwards = (weighted * axes[frame, 1:, axis]).sum(axis=1)
                way[:, axis] += np.bincount(some[frame], outwards, minlength=len(way))
        return depth, way


def arm_points(motion: Motion, side: str, from_wrist: bool = False) -> np.ndarray:
    """``(frames, n, 3)`` metres: points of the skin of a hand and its forearm, or of the hand alone, spread
    evenly."""
    mesh = _limb(motion.character, f"{side}_{'hand' if from_wrist else 'forearm'}")
    return np.zeros((motion.frames, 0, 3)) if mesh is None else mesh.skinned(motion)


@lru_cache(maxsize=32)
def _limb(body: Character, role: str) -> Mesh | None:
    """The vertices that stand for a limb from a joint on, without faces; None where it has none."""
    mesh, joint = body.mesh, body.joint_of.get(role)
    if mesh is None or joint is None:
        return None
    own = np.flatnonzero(moved_vertices(mesh, body.skeleton, joint))
    if not len(own):
        return None
    cells = np.floor(mesh.vertices[own] / (_POINT * body.height)).astype(np.int64)
    own = own[np.unique(cells, axis=0, return_index=True)[1]]
    return Mesh(mesh.vertices[own], np.zeros((0, 3), dtype=np.int64), mesh.weights[own], mesh.pose)
