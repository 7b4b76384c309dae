"""Limbs of a skinned body: which vertices are a limb's, and the rest of the body as a closed surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.penetration.winding import is_closed
from retarget_bench.motion.roles import SIDES
from retarget_bench.motion.skeleton import Skeleton

MOST = 0.5
"""Total weight of joints above which a vertex is theirs."""
LIMBS = (("arm", "forearm"), ("up_leg", "leg"))
"""Role at which a limb leaves the body, and role from which on its vertices are tested."""


@dataclass(frozen=True, eq=False)
class Limb:
    """A limb and the rest of its body, as vertex numbers of the body's mesh.

    name:   ``left_arm``.
    tested: ``(n,)`` the vertices from elbow or knee on. areas: ``(n,)`` square metres around each.
    faces:  ``(F, 3)`` the body without the whole limb, from shoulder or hip on.
    rims:   vertices around each cut that took the limb away.
    caps:   for each, ``(edges, 2)``: with the middle of its rim these make the triangles that close it.
    sealed: the rest of the body, with caps, has no holes left.
    """

    name: str
    tested: np.ndarray
    areas: np.ndarray
    faces: np.ndarray
    rims: tuple[np.ndarray, ...]
    caps: tuple[np.ndarray, ...]
    sealed: bool = False

    def closed(self, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The rest of the body ``(V + rims, 3)`` and its triangles ``(F + edges, 3)``, of ``(V, 3)``."""
        middles = [vertices[rim].mean(axis=0) for rim in self.rims]
        fans = [
            np.column_stack([edges, np.full(len(edges), len(vertices) + k)])
            for k, edges in enumerate(self.caps)
        ]
        return np.concatenate([vertices, np.reshape(middles, (-1, 3))]), np.concatenate([self.faces, *fans])


@lru_cache(maxsize=256)
def limbs(body: Character) -> tuple[Limb, ...]:
    """The arms and legs of a body with a mesh; those without roles or own vertices are left out."""
    mesh = body.mesh
    if mesh is None or not len(mesh.faces):
        return ()
    welded = weld(mesh)
    candidates = []
    for side in SIDES:
        for top, middle in LIMBS:
            joints = [body.joint_of.get(f"{side}_{part}") for part in (top, middle)]
            if joints[0] is not None and joints[1] is not None:
                candidates.append(
                    _limb(f"{side}_{top}", mesh, welded, body.skeleton, (joints[0], joints[1]))
                )
    return tuple(limb for limb in candidates if len(limb.tested) and len(limb.faces))


def _limb(name: str, mesh: Mesh, welded: np.ndarray, skeleton: Skeleton, joints: Sequence[int]) -> Limb:
    entire, tested = (moved_vertices(mesh, skeleton, joint) for joint in joints)
    rest = welded[~entire[mesh.faces].any(axis=1)]
    rims, caps = _cuts(rest, _open_edges(welded))
    numbers = np.flatnonzero(tested & np.isin(np.arange(len(tested)), mesh.faces))
    limb = Limb(name, numbers, vertex_areas(mesh)[numbers], rest, rims, caps)
    return replace(limb, sealed=is_closed(limb.closed(mesh.vertices)[1]))


def moved_vertices(mesh: Mesh, skeleton: Skeleton, joint: int) -> np.ndarray:
    """``(V,)`` bool: vertices that a joint and those below it move for the most part."""
    return np.asarray(mesh.weights[:, below(skeleton, joint)].sum(axis=1) > MOST)


def below(skeleton: Skeleton, joint: int) -> np.ndarray:
    """``(joints,)`` bool: a joint and all that hang from it."""
    mask = np.zeros(len(skeleton), dtype=bool)
    mask[joint] = True
    for k, parent in enumerate(skeleton.parents.tolist()):
        mask[k] |= parent >= 0 and mask[parent]
    return mask


def weld(mesh: Mesh) -> np.ndarray:
    """``(F, 3)`` the faces with one number for vertices at one place: seams of textures are no edges."""
    _, first, number = np.unique(mesh.vertices, axis=0, return_index=True, return_inverse=True)
    return np.asarray(first[number.reshape(-1)][mesh.faces])


def vertex_areas(mesh: Mesh) -> np.ndarray:
    """``(V,)`` square metres: a third of the area of the faces around each vertex, of the mesh as drawn."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    third = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    return np.bincount(mesh.faces.reshape(-1), np.repeat(third, 3), minlength=len(mesh.vertices))


def _open_edges(faces: np.ndarray) -> np.ndarray:
    """``(edges, 2)`` edges of faces ``(F, 3)`` that no other face has in the opposite direction."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    size = int(faces.max(initial=0)) + 1
    forth, back = edges[:, 0] * size + edges[:, 1], edges[:, 1] * size + edges[:, 0]
    return edges[~np.isin(forth, back)]


def _cuts(rest: np.ndarray, holes: np.ndarray) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
    """Rims and caps (see ``Limb``) of what is open in the rest ``(F, 3)``, but for the ``holes``
    ``(edges, 2)`` that the whole mesh has."""
    from scipy.sparse import coo_matrix  # type: ignore[import-untyped]
    from scipy.sparse.csgraph import connected_components  # type: ignore[import-untyped]

    edges = _open_edges(rest)
    hole_edges = {tuple(edge) for edge in holes.tolist()}
    edges = np.array([edge for edge in edges.tolist() if tuple(edge) not in hole_edges]).reshape(-1, 2)
    if not len(edges):
        return (), ()
    size = int(edges.max()) + 1
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (size, size))
    loop = connected_components(graph, directed=False)[1][edges[:, 0]]
    # a cap runs along its rim in the opposite direction, as neighbouring faces do
    caps = tuple(edges[loop == one][:, ::-1] for one in np.unique(loop))
    return tuple(np.unique(cap) for cap in caps), caps
