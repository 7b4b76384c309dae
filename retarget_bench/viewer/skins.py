"""Compact skins for pages: few triangles, few joints per corner, integers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion

IN_PAGES, LIVE = 3000, 12000
"""Triangles of a skin at most, in a page and in the live view: of those with more, corners that are close
to each other are put together."""
FOLLOWED = 4
"""Joints that a corner follows, those with the largest shares."""
FULL_WEIGHT = 1023
"""The sum of the shares of a corner: ten bits; with eight, corners would be up to 2 mm off."""
_TRIES = 14
_SHIFT = 0.37
"""Of cells, in their own size: planes of symmetry, where seams are, should lie inside them."""


@dataclass(frozen=True, eq=False)
class Skin:
    """A mesh as pages have it, its corners in the order in which its faces ask for them.

    mesh:   its corners are all for its triangles.
    joints: ``(used,)`` those that are followed. followed: ``(vertices, FOLLOWED)`` places among them, the
            largest share first. shares: ``(vertices, FOLLOWED)`` whole numbers that sum to ``FULL_WEIGHT``.
    place:  of each vertex of the whole mesh its corner here, -1 for those that no face is left of.
    """

    mesh: Mesh
    joints: np.ndarray
    followed: np.ndarray
    shares: np.ndarray
    place: np.ndarray

    @classmethod
    @lru_cache(maxsize=16)
    def of(cls, mesh: Mesh, most: int) -> Skin:
        """The compact skin of a mesh, of at most so many triangles. Where shares are left out, the others
        grow by as much."""
        fewer, into = merged(mesh, most)
        small, number = _in_order(fewer)
        order = np.argsort(-small.weights, axis=1, kind="stable")[:, :FOLLOWED]
        weights = np.take_along_axis(small.weights, order, axis=1)
        shares = _quantized(weights / weights.sum(axis=1, keepdims=True))
        order = np.where(shares > 0, order, order[:, :1])  # a share of nothing needs no joint
        if order.shape[1] < FOLLOWED:
            pad = FOLLOWED - order.shape[1]
            order = np.pad(order, ((0, 0), (0, pad)), mode="edge")
            shares = np.pad(shares, ((0, 0), (0, pad)))
        joints, followed = np.unique(order, return_inverse=True)
        return cls(small, joints, followed.reshape(order.shape), shares, number[into])

    def middles(self, vertices: np.ndarray) -> np.ndarray:
        """``(frames, corners, 3)``: of a whole mesh with vertices ``(frames, V, 3)``."""
        order = np.argsort(self.place, kind="stable")
        order = order[self.place[order] >= 0]
        _, first, count = np.unique(self.place[order], return_index=True, return_counts=True)
        sums = np.add.reduceat(vertices[:, order], first, axis=1)
        centres: np.ndarray = sums / count[:, None]
        return centres

    def any(self, chosen: np.ndarray) -> np.ndarray:
        """``(frames, corners)`` bool: where any vertex of a corner is chosen ``(frames, V)``."""
        placed = self.place >= 0
        matches = np.zeros((len(chosen), len(self.mesh.vertices)), dtype=bool)
        frame, vertex = np.nonzero(chosen & placed)
        matches[frame, self.place[vertex]] = True
        return matches

    def back(self) -> np.ndarray:
        """``(faces * 3,)``: how far every corner is behind the first number that no face has had yet."""
        corners = self.mesh.faces.ravel()
        had = np.maximum.accumulate(np.concatenate([[-1], corners[:-1]]))
        return had + 1 - corners

    def turns(self, motion: Motion) -> np.ndarray:
        """``(frames, used, 4)``: rotations from the mesh's pose to that of the motion, without jumps."""
        _, turned = self.mesh.bound(motion.skeleton)
        turns = rotation.multiply(motion.global_rotations, rotation.conjugate(turned))
        return rotation.continuous(turns[:, self.joints])


def merged(mesh: Mesh, most: int) -> tuple[Mesh, np.ndarray]:
    """A mesh of at most so many triangles, and ``(vertices,)`` the vertex that each vertex became part of.

    Corners in the same cell of a grid that follow the same joint most become one in their middle (vertex
    clustering, Rossignac and Borrel 1993); the cells are as small as they can be.
    """
    if len(mesh.faces) <= most:
        return mesh, np.arange(len(mesh.vertices))
    high = float(np.ptp(mesh.vertices, axis=0).max()) or 1.0
    low, best = high / 1000.0, _clustered(mesh, high)
    for _ in range(_TRIES):
        tried = _clustered(mesh, middle := (low * high) ** 0.5)
        if len(tried[0].faces) > most:
            low = middle
        else:
            high, best = middle, tried
    return best


def _clustered(mesh: Mesh, step: float) -> tuple[Mesh, np.ndarray]:
    cells = np.floor(mesh.vertices / step + _SHIFT).astype(np.int64)
    cells -= cells.min(axis=0)
    number = np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1))
    keys = number * mesh.weights.shape[1] + mesh.weights.argmax(axis=1)
    _, place, held = np.unique(keys, return_inverse=True, return_counts=True)
    faces = place[mesh.faces]
    proper = (faces != np.roll(faces, 1, axis=1)).all(axis=1)

    def middles(values: np.ndarray) -> np.ndarray:
        sums = np.zeros((len(held), values.shape[1]))
        np.add.at(sums, place, values)
        return sums / held[:, None]

    return Mesh(middles(mesh.vertices), faces[proper], middles(mesh.weights), mesh.pose), place


def _in_order(mesh: Mesh) -> tuple[Mesh, np.ndarray]:
    """The same surface; its vertices are numbered as its faces come to them, the rest are gone. And the new
    number of each vertex, -1 for the rest."""
    used, first, place = np.unique(mesh.faces, return_index=True, return_inverse=True)
    order = np.argsort(first)
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.arange(len(order))
    faces = number[place].reshape(mesh.faces.shape)
    numbers = np.full(len(mesh.vertices), -1)
    numbers[used] = number
    return Mesh(mesh.vertices[used[order]], faces, mesh.weights[used[order]], mesh.pose), numbers


def _quantized(weights: np.ndarray) -> np.ndarray:
    """``FULL_WEIGHT`` times the weights, rounded; the first and largest takes up the difference."""
    shares = np.rint(FULL_WEIGHT * weights).astype(np.int64)
    shares[:, 0] += FULL_WEIGHT - shares.sum(axis=1)
    return shares
