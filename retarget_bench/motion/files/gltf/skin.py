"""The surface of a body in a glTF file, on its skeleton in the bind pose."""

from __future__ import annotations

from typing import Any

import numpy as np

from retarget_bench.motion.files.gltf.bodies import skin_joints
from retarget_bench.motion.files.gltf.document import Document
from retarget_bench.motion.files.gltf.nodes import transform
from retarget_bench.motion.files.gltf.rig import Rig, bind_matrices
from retarget_bench.motion.mesh import Mesh

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_FARTHEST = 1e9
_MOST_WEIGHTS = 1 << 27
"""Vertices times joints: 1 GB of weights."""


def has_surface(rig: Rig) -> bool:
    """Whether a mesh that can be read follows the body."""
    return any(True for _ in _parts(rig))


def _parts(rig: Rig) -> list[tuple[int, int, bool]]:
    """(node, mesh, whether it is skinned) for all meshes on the body."""
    document = rig.document
    found = []
    for node, item in enumerate(document.items("nodes")):
        mesh = item.get("mesh")
        if mesh is None:
            continue
        document.item("meshes", mesh, f"nodes[{node}]")
        if item.get("skin") is not None:
            if item["skin"] in rig.body.skins:
                found.append((node, mesh, True))
        elif set(rig.body.joints) & {node, *rig.nodes.above(node)}:
            found.append((node, mesh, False))
    return found


def surface(rig: Rig) -> Mesh:
    """The triangles of all meshes on a body, in the file's unit and axes, the skeleton unturned.

    Skinned meshes follow their joints; other meshes below a joint follow that joint. Morph targets, points
    and lines are left out. Raises FileError where the arrays do not fit.
    """
    document = rig.document
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for node, number, skinned in _parts(rig):
        seen: dict[tuple[Any, ...], int] = {}
        by = f"meshes[{number}]"
        for primitive in document.listed(document.items("meshes")[number], "primitives", by):
            attributes = document.inside(primitive, "attributes", by)
            if "KHR_draco_mesh_compression" in document.inside(primitive, "extensions", by):
                raise document.fail("has a mesh compressed by Draco, which is not read: export it without")
            mode = document.whole(primitive, "mode", by, _TRIANGLES)
            if mode not in (_TRIANGLES, _STRIP, _FAN) or "POSITION" not in attributes:
                continue
            key = tuple(sorted((name, str(value)) for name, value in attributes.items()))
            if key not in seen:
                seen[key] = sum(len(part[0]) for part in parts)
                places, weights = _vertices(rig, node, attributes, skinned, by)
                parts.append((places, weights, np.zeros((0, 3), dtype=np.int64)))
            count = len(document.array(attributes["POSITION"], ("VEC3",), by))
            faces = _faces(document, primitive, mode, count, by)
            parts.append((np.zeros((0, 3)), np.zeros((0, len(rig.skeleton))), faces + seen[key]))
    if not parts:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64), np.zeros((0, len(rig.skeleton))))
    places, weights, faces = (np.concatenate(each) for each in zip(*parts, strict=True))
    mirrored = np.linalg.det(rig.matrices[0, :3, :3]) < 0
    return Mesh(places, faces[:, ::-1] if mirrored else faces, weights)


def _vertices(
    rig: Rig, node: int, attributes: dict[str, Any], skinned: bool, by: str
) -> tuple[np.ndarray, np.ndarray]:
    """Places ``(vertices, 3)`` in the skeleton's own pose, and weights ``(vertices, joints)``."""
    document = rig.document
    places = np.asarray(document.array(attributes["POSITION"], ("VEC3",), by), dtype=np.float64)
    if len(places) * len(rig.skeleton) > _MOST_WEIGHTS:
        raise document.fail(f"{by} has {len(places)} vertices on {len(rig.skeleton)} joints: too many")
    if np.abs(places).max(initial=0.0) > _FARTHEST:
        raise document.fail(f"{by} has vertices beyond {_FARTHEST:g}: it is damaged")
    if not skinned:
        return _carried(rig, node, places)
    skin = document.items("nodes")[node]["skin"]
    weights = _weights(rig, attributes, len(skin_joints(document, skin)), len(places), by)
    bound = bind_matrices(document, skin)
    joints = skin_joints(document, skin)
    place = {each: joint for joint, each in enumerate(rig.body.joints)}
    at = np.array([_kept(rig, place, each) for each in joints])
    standing = rig.nodes.matrices(joints)
    matrices = np.stack([rig.matrices[place[each]] if each in place else standing[each] for each in joints])
    if bound is not None:
        matrices = matrices @ bound
    blended = (weights @ matrices.reshape(len(joints), 16)).reshape(-1, 4, 4)
    moved = np.einsum("vab,vb->va", blended[:, :3, :3], places) + blended[:, :3, 3]
    own = np.zeros((len(places), len(rig.skeleton)))
    for column, joint in enumerate(at):
        own[:, joint] += weights[:, column]
    return moved, own


def _kept(rig: Rig, place: dict[int, int], node: int) -> int:
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


def _weights(rig: Rig, attributes: dict[str, Any], joints: int, vertices: int, by: str) -> np.ndarray:
    """``(vertices, joints of the skin)`` shares that sum to 1."""
    document = rig.document
    found = np.zeros((vertices, joints))
    rows = np.arange(vertices)
    number = 0
    while f"JOINTS_{number}" in attributes and f"WEIGHTS_{number}" in attributes and number < 16:
        at = document.array(attributes[f"JOINTS_{number}"], ("VEC4",), by).astype(np.int64)
        share = np.asarray(document.array(attributes[f"WEIGHTS_{number}"], ("VEC4",), by), dtype=np.float64)
        if len(at) != vertices or len(share) != vertices:
            raise document.fail(
                f"{by} has {vertices} vertices, {len(at)} joint lists and {len(share)} weights"
            )
        used = share > 0
        if at.size and not 0 <= int(at[used].min(initial=0)) <= int(at[used].max(initial=0)) < joints:
            raise document.fail(f"{by} follows joints that its skin of {joints} does not have")
        if share.max(initial=0.0) > 1e6:
            raise document.fail(f"{by} has weights above 1: it is damaged")
        for k in range(4):
            found[rows, np.where(used[:, k], at[:, k], 0)] += np.where(used[:, k], share[:, k], 0.0)
        number += 1
    total = found.sum(axis=1, keepdims=True)
    found[total[:, 0] <= 0, 0] = 1.0
    return found / np.where(total > 0, total, 1.0)


def _faces(document: Document, primitive: dict[str, Any], mode: int, vertices: int, by: str) -> np.ndarray:
    """``(faces, 3)`` indices of triangles, from a list, strip or fan."""
    if primitive.get("indices") is None:
        corners = np.arange(vertices)
    else:
        corners = document.array(primitive["indices"], ("SCALAR",), by)[:, 0].astype(np.int64)
    if corners.size and not 0 <= int(corners.min()) <= int(corners.max()) < vertices:
        raise document.fail(f"{by} has faces with vertices that it has not")
    if mode == _TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if len(corners) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    count = np.arange(len(corners) - 2)
    if mode == _FAN:
        return corners[np.stack([count * 0, count + 1, count + 2], axis=1)]
    odd = count % 2
    return corners[np.stack([count, count + 1 + odd, count + 2 - odd], axis=1)]
