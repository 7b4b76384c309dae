"""A body with a coarse mesh, on which questions of inside and outside are answered fast.

Vertices of a cell of a grid that follow the same joint become one of them (vertex clustering, Rossignac and
Borrel 1993). A closed surface stays closed: faces lose edges in pairs.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.penetration.limbs import weld

CELL = 0.03
"""Side of a cell, body heights."""


@lru_cache(maxsize=16)
def coarse_body(body: Character) -> Character:
    """A character with a mesh, of which the mesh is coarse."""
    mesh = body.mesh
    assert mesh is not None
    made = clustered(mesh, CELL * body.height)
    return replace(body, skin=partial(_given, made))


def clustered(mesh: Mesh, cell: float) -> Mesh:
    """The mesh with one vertex for all that lie in a cell of this side, metres, and follow one joint."""
    faces = weld(mesh)
    cells = np.floor((mesh.vertices - mesh.vertices.min(axis=0)) / cell).astype(np.int64)
    key = np.column_stack([cells, mesh.weights.argmax(axis=1)])
    _, group = np.unique(key, axis=0, return_inverse=True)
    group = group.reshape(-1)
    chosen = _nearest_to_mean(mesh.vertices, group)
    corners = group[faces]
    kept = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    used, numbers = np.unique(corners[kept], return_inverse=True)
    one = chosen[used]
    return Mesh(mesh.vertices[one], numbers.reshape(-1, 3), mesh.weights[one], mesh.pose)


def _nearest_to_mean(vertices: np.ndarray, group: np.ndarray) -> np.ndarray:
    """``(groups,)`` of each group the vertex that is nearest to the mean of all its own."""
    count = np.bincount(group)
    mean = np.stack([np.bincount(group, axis) for axis in vertices.T], axis=1) / count[:, None]
    order = np.lexsort((np.linalg.norm(vertices - mean[group], axis=1), group))
    return order[np.concatenate([[0], np.cumsum(count)[:-1]])]


def _given(mesh: Mesh) -> Mesh:
    return mesh
