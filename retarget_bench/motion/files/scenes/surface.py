"""The surface of a body, on its skeleton in the bind pose."""

from __future__ import annotations

import numpy as np

from retarget_bench.motion.files.scenes.nodes import transform
from retarget_bench.motion.files.scenes.rig import Rig
from retarget_bench.motion.files.scenes.scene import Piece, Surface
from retarget_bench.motion.mesh import Mesh

_FARTHEST = 1e9
_MOST_WEIGHTS = 1 << 27
"""Vertices times joints: 1 GB of weights."""


def has_surface(rig: Rig) -> bool:
    """Whether a mesh that can be read follows the body."""
    return bool(_surfaces(rig))


def _surfaces(rig: Rig) -> list[Surface]:
    """The meshes on the body: those that follow its skins, and others at or below a joint."""
    joints, surfaces = set(rig.body.joints), []
    for each in rig.scene.surfaces():
        if each.skin is not None:
            on_body = each.skin in rig.body.skins
        else:
            on_body = bool(joints & {each.node, *rig.nodes.above(each.node)})
        if on_body:
            surfaces.append(each)
    return surfaces


def surface(rig: Rig) -> Mesh:
    """The triangles of all meshes on a body, in the file's unit and axes, the skeleton unturned.

    Skinned meshes follow their joints; other meshes below a joint follow that joint. Morph targets, points
    and lines are left out. Raises FileError where the arrays do not fit.
    """
    parts = [(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64), np.zeros((0, len(rig.skeleton))))]
    count = 0
    for each in _surfaces(rig):
        for piece in rig.scene.pieces(each):
            _check_size(rig, each, piece)
            if each.skin is not None and piece.weights is not None:
                places, weights = _skinned(rig, each.skin, piece.vertices, piece.weights)
            else:
                places, weights = _carried(rig, each.node, piece.vertices)
            parts.append((places, piece.faces + count, weights))
            count += len(places)
    places, faces, weights = (np.concatenate(each) for each in zip(*parts, strict=True))
    mirrored = np.linalg.det(rig.matrices[0, :3, :3]) < 0
    return Mesh(places, faces[:, ::-1] if mirrored else faces, weights)


def _check_size(rig: Rig, of: Surface, piece: Piece) -> None:
    by, count = f"meshes[{of.number}]", len(piece.vertices)
    if count * len(rig.skeleton) > _MOST_WEIGHTS:
        raise rig.scene.fail(f"{by} has {count} vertices on {len(rig.skeleton)} joints: too many")
    if np.abs(piece.vertices).max(initial=0.0) > _FARTHEST:
        raise rig.scene.fail(f"{by} has vertices beyond {_FARTHEST:g}: it is damaged")


def _skinned(rig: Rig, skin: int, places: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places ``(vertices, 3)`` in the skeleton's own pose, and weights ``(vertices, joints)``."""
    bound, joints = rig.scene.bind_matrices(skin), rig.scene.skin_joints(skin)
    place = {each: joint for joint, each in enumerate(rig.body.joints)}
    standing = rig.nodes.matrices(joints)
    matrices = np.stack([rig.matrices[place[each]] if each in place else standing[each] for each in joints])
    if bound is not None:
        matrices = matrices @ bound
    blended = (weights @ matrices.reshape(len(joints), 16)).reshape(-1, 4, 4)
    moved = np.einsum("vab,vb->va", blended[:, :3, :3], places) + blended[:, :3, 3]
    own = np.zeros((len(places), len(rig.skeleton)))
    for column, each in enumerate(joints):
        own[:, _joint_of(rig, place, each)] += weights[:, column]
    return moved, own


def _joint_of(rig: Rig, place: dict[int, int], node: int) -> int:
    """The joint of the skeleton that a joint of a skin belongs to: itself, or the closest above, or the
    root."""
    while node >= 0 and node not in place:
        node = rig.nodes.parents[node]
    return place.get(node, 0)


def _carried(rig: Rig, node: int, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A mesh that hangs on a joint without a skin."""
    place = {each: joint for joint, each in enumerate(rig.body.joints)}
    nodes, local = rig.nodes, np.eye(4)
    while node not in place:
        own = transform(nodes.translation[node], nodes.rotation[node], nodes.scale[node])
        local, node = own @ local, nodes.parents[node]
    matrix = rig.matrices[place[node]] @ local
    weights = np.zeros((len(places), len(rig.skeleton)))
    weights[:, place[node]] = 1.0
    return places @ matrix[:3, :3].T + matrix[:3, 3], weights
