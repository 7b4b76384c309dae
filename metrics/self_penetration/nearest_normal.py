"""The published test of penetration by the nearest vertex and its normal, which is wrong at rest."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.penetration.limbs import below
from retarget_bench.motion.roles import SIDES

LIMBS = ("arm", "leg")
"""Roles from which on vertices are tested: arms without shoulders, legs without thighs."""


def rate(body: Character, vertices: np.ndarray) -> float | None:
    """Share of tested vertices and frames ``(frames, V, 3)`` that count as inside; None without limbs.

    A vertex v of a limb counts where (n - v) . N > 0, with n the nearest vertex of the body without the
    limb and N the normal there. A vertex belongs to the joint of its largest weight.
    """
    from scipy.spatial import cKDTree  # type: ignore[import-untyped]

    mesh, parts = body.mesh, limbs(body)
    if mesh is None or not parts:
        return None
    hits = total = 0
    for frame in vertices:
        normals = vertex_normals(frame, mesh.faces)
        for limb, rest in parts:
            near = rest[cKDTree(frame[rest]).query(frame[limb])[1]]
            hits += int((np.einsum("vc,vc->v", frame[near] - frame[limb], normals[near]) > 0.0).sum())
            total += len(limb)
    return hits / total


@lru_cache(maxsize=256)
def limbs(body: Character) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Vertices of each limb ``(n,)`` and those of the body without it ``(m,)``, by number."""
    return tuple(_limbs(body))


def _limbs(body: Character) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    if body.mesh is None:
        return
    joint = body.mesh.weights.argmax(axis=1)
    for side in SIDES:
        for part in LIMBS:
            top = body.joint_of.get(f"{side}_{part}")
            if top is None:
                continue
            own = below(body.skeleton, top)[joint]
            if own.any() and not own.all():
                yield np.flatnonzero(own), np.flatnonzero(~own)


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """``(V, 3)`` sums of the normals of the faces around each vertex, longer for larger faces."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals, sums = np.cross(b - a, c - a), np.zeros_like(vertices)
    for k in range(3):
        np.add.at(sums, faces[:, k], normals)
    return sums
