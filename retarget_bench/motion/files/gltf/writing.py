"""Motions as new GLB files: a skeleton, its animation, and the skin where the body has one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Motion
from retarget_bench.motion.files.gltf.building import INDICES, VERTICES, AnimationBuilder, Builder
from retarget_bench.motion.files.scenes.nodes import transform
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.skeleton import Skeleton

_LEAST = 1e-4
"""Weights below it are left out."""


def write(path: str | Path, motion: Motion) -> None:
    """Write a motion as a GLB file of its own, in metres and Y up.

    Joints are nodes that do not turn at rest, tips are nodes called ``NAME_end``; all are joints of a skin,
    so that programs take them for bones. The body's mesh, where it has one, is the skin's.
    Raises FileError where a number is not finite, or the file cannot be written.
    """
    path = Path(path)
    check_frames(path, motion)
    skeleton, mesh = motion.skeleton, motion.character.mesh
    builder = Builder({"asset": {"version": "2.0", "generator": "retarget-bench"}, "scene": 0})
    builder.content["scenes"] = [{"nodes": [0]}]
    for item in _nodes(skeleton):
        builder.add("nodes", item)
    builder.add("skins", _skin(builder, skeleton, mesh))
    if mesh is not None and len(mesh.vertices) and len(mesh.faces):
        primitive = _primitive(builder, mesh, len(skeleton))
        number = builder.add("meshes", {"name": motion.character.name, "primitives": [primitive]})
        node = {"name": f"{motion.character.name}_mesh", "mesh": number, "skin": 0}
        builder.content["scenes"][0]["nodes"].append(builder.add("nodes", node))
    animation = AnimationBuilder(builder, path.stem, motion.frames, motion.fps)
    animation.track(0, "translation", motion.root)
    for joint in range(len(skeleton)):
        animation.track(joint, "rotation", motion.rotations[:, joint])
    builder.add("animations", animation.finished())
    builder.save(path)


def check_frames(path: Path, motion: Motion) -> None:
    """Refuse a motion without frames, or with NaN or infinity. Raises FileError."""
    if not motion.frames:
        raise FileError(path, "not written: the motion has no frames")
    finite = np.isfinite(motion.rotations).all(axis=(1, 2)) & np.isfinite(motion.root).all(axis=1)
    if not finite.all():
        frame = int(np.argmin(finite)) + 1
        raise FileError(path, f"not written: frame {frame} of the motion holds NaN or infinity")


def _nodes(skeleton: Skeleton) -> list[dict[str, Any]]:
    """Joints, then tips; a joint's number is its place in the skeleton."""
    nodes: list[dict[str, Any]] = [
        {"name": name, "translation": offset.tolist()}
        for name, offset in zip(skeleton.names, skeleton.offsets, strict=True)
    ]
    for joint, children in enumerate(skeleton.children):
        if children:
            nodes[joint]["children"] = list(children)
    for site in skeleton.end_sites:
        nodes[site.parent].setdefault("children", []).append(len(nodes))
        nodes.append({"name": f"{skeleton.names[site.parent]}_end", "translation": list(site.offset)})
    return nodes


def _skin(builder: Builder, skeleton: Skeleton, mesh: Mesh | None) -> dict[str, Any]:
    """The joints, with the pose in which the mesh lies on them: the skeleton unturned, or the mesh's."""
    places, turned = skeleton.rest_positions, rotation.identity(len(skeleton))
    if mesh is not None:
        places, turned = mesh.bound(skeleton)
    back = rotation.conjugate(turned)
    matrices = transform(-rotation.rotate(back, places), back, np.ones((len(skeleton), 3)))
    matrices = matrices.transpose(0, 2, 1).reshape(-1, 16)
    return {
        "joints": list(range(len(skeleton))),
        "skeleton": 0,
        "inverseBindMatrices": builder.array(matrices, "<f4"),
    }


def _primitive(builder: Builder, mesh: Mesh, joints: int) -> dict[str, Any]:
    """The triangles, with normals, and each vertex's joints, those with the largest weights first."""
    order = np.argsort(-mesh.weights, axis=1, kind="stable")
    share = np.take_along_axis(mesh.weights, order, axis=1)
    most = max(int((share > _LEAST).sum(axis=1).max(initial=1)), 1)
    sets = min(-(-most // 4), -(-joints // 4))
    share = np.where(share > _LEAST, share, 0.0)[:, : 4 * sets]
    share = np.pad(share, ((0, 0), (0, 4 * sets - share.shape[1])))
    order = np.pad(order[:, : 4 * sets], ((0, 0), (0, max(0, 4 * sets - joints))))
    order = np.where(share > 0, order, 0)
    share = share / share.sum(axis=1, keepdims=True)
    attributes = {
        "POSITION": builder.array(mesh.vertices, "<f4", target=VERTICES, bounds=True),
        "NORMAL": builder.array(_normals(mesh), "<f4", target=VERTICES),
    }
    for number in range(sets):
        part = slice(4 * number, 4 * number + 4)
        attributes[f"JOINTS_{number}"] = builder.array(order[:, part], "<u2", target=VERTICES)
        attributes[f"WEIGHTS_{number}"] = builder.array(share[:, part], "<f4", target=VERTICES)
    indices = builder.array(mesh.faces.reshape(-1, 1), "<u4", target=INDICES)
    return {"attributes": attributes, "indices": indices}


def _normals(mesh: Mesh) -> np.ndarray:
    """``(vertices, 3)`` unit vectors: the mean of the faces' normals by area; up where there is no face."""
    corners = mesh.vertices[mesh.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(mesh.vertices, dtype=np.float64)
    for corner in range(3):
        np.add.at(normals, mesh.faces[:, corner], across)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 1e-20, normals / np.maximum(length, 1e-20), [0.0, 1.0, 0.0])
