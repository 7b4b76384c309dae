"""The meshes of a glTF file: triangles, and the joints that their vertices follow."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from retarget_bench.motion.files.gltf.document import Document
from retarget_bench.motion.files.scenes.scene import Piece, Surface

_TRIANGLES, _STRIP, _FAN = 4, 5, 6


def surfaces(document: Document) -> list[Surface]:
    """The meshes at the nodes of a file. Raises FileError for numbers that there are not."""
    surfaces = []
    for node, item in enumerate(document.items("nodes")):
        if (mesh := item.get("mesh")) is not None:
            document.item("meshes", mesh, f"nodes[{node}]")
            if (skin := item.get("skin")) is not None:
                document.item("skins", skin, f"nodes[{node}]")
            surfaces.append(Surface(node, mesh, skin))
    return surfaces


def pieces(document: Document, number: int, joints: int | None) -> Iterator[Piece]:
    """The triangles of a mesh, one piece for the primitives that share their vertices.

    joints: of the skin that it follows; None without. Morph targets, points and lines are left out.
    Raises FileError where the arrays do not fit.
    """
    by = f"meshes[{number}]"
    shared: dict[tuple[tuple[str, str], ...], list[tuple[dict[str, Any], int]]] = {}
    for primitive in document.listed(document.items("meshes")[number], "primitives", by):
        attributes = document.inside(primitive, "attributes", by)
        if "KHR_draco_mesh_compression" in document.inside(primitive, "extensions", by):
            raise document.fail("has a mesh compressed by Draco, which is not read: export it without")
        mode = document.integer(primitive, "mode", by, _TRIANGLES)
        if mode in (_TRIANGLES, _STRIP, _FAN) and "POSITION" in attributes:
            key = tuple(sorted((name, str(value)) for name, value in attributes.items()))
            shared.setdefault(key, []).append((primitive, mode))
    for alike in shared.values():
        attributes = alike[0][0]["attributes"]
        places = np.asarray(document.array(attributes["POSITION"], ("VEC3",), by), dtype=np.float64)
        count = len(places)
        faces = [_faces(document, primitive, mode, count, by) for primitive, mode in alike]
        weights = None if joints is None else _weights(document, attributes, joints, count, by)
        yield Piece(places, np.concatenate(faces), weights)


def _weights(
    document: Document, attributes: dict[str, Any], joints: int, vertices: int, by: str
) -> np.ndarray:
    """``(vertices, joints of the skin)`` shares that sum to 1."""
    weights = np.zeros((vertices, joints))
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
            weights[rows, np.where(used[:, k], at[:, k], 0)] += np.where(used[:, k], share[:, k], 0.0)
        number += 1
    total = weights.sum(axis=1, keepdims=True)
    weights[total[:, 0] <= 0, 0] = 1.0
    return weights / np.where(total > 0, total, 1.0)


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
