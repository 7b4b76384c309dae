"""Motions as new GLB files: a skeleton, its animation, and the skin where the body has one."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Motion
from retarget_bench.motion.files.gltf.document import COMPONENTS, MAGIC
from retarget_bench.motion.files.scenes.scene import transform
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.skeleton import Skeleton

_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_CODES = {kind: code for code, kind in COMPONENTS.items()}
VERTICES, INDICES = 34962, 34963
"""Targets of buffer views."""
_LARGEST = (1 << 32) - 1


class Builder:
    """The JSON of a file, and the bytes of its only buffer, both of which grow.

    content: the JSON, which is changed in place. binary: bytes that stay as they are, before all others.
    """

    def __init__(self, content: dict[str, Any], binary: bytes = b"") -> None:
        self.content, self._data = content, bytearray(binary)

    def bytes_view(self, data: bytes, target: int | None = None) -> int:
        """The number of a new buffer view with these bytes."""
        self._data += b"\0" * (-len(self._data) % 4)
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self._data), "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        self._data += data
        return self.add("bufferViews", view)

    def array(
        self, values: np.ndarray, kind: str, *, target: int | None = None, bounds: bool = False
    ) -> int:
        """The number of a new accessor with ``(count, width)`` values of a NumPy type such as ``<f4``.

        bounds: state the smallest and largest values, as times and places of vertices need.
        """
        stored = np.ascontiguousarray(values, dtype=kind)
        accessor: dict[str, Any] = {
            "bufferView": self.bytes_view(stored.tobytes(), target),
            "componentType": _CODES[stored.dtype],
            "count": len(stored),
            "type": _TYPES[stored.shape[1]],
        }
        if bounds:
            accessor["min"] = stored.min(axis=0).tolist()
            accessor["max"] = stored.max(axis=0).tolist()
        return self.add("accessors", accessor)

    def add(self, key: str, item: dict[str, Any]) -> int:
        """The number of a new object of a list at the top level."""
        items: list[dict[str, Any]] = self.content.setdefault(key, [])
        items.append(item)
        return len(items) - 1

    def save(self, path: Path) -> None:
        """Write the file, whole or not at all. Raises FileError."""
        self._data += b"\0" * (-len(self._data) % 4)
        self.content["buffers"] = [{"byteLength": len(self._data)}]
        text = json.dumps(self.content, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
        head = text.encode("utf-8", "surrogatepass")
        head += b" " * (-len(head) % 4)
        total = 12 + 8 + len(head) + 8 + len(self._data)
        if total > _LARGEST:
            raise FileError(path, "not written: a GLB file holds 4 GB at most")
        with atomic(path) as temporary, temporary.open("wb") as file:
            file.write(MAGIC + struct.pack("<II", 2, total))
            file.write(struct.pack("<I4s", len(head), b"JSON") + head)
            file.write(struct.pack("<I4s", len(self._data), b"BIN\0"))
            file.write(self._data)


class AnimationBuilder:
    """An animation of a file being put together: frames at one rate, connected linearly.

    frames: how many. fps: frames per second.
    """

    def __init__(self, builder: Builder, name: str, frames: int, fps: float) -> None:
        self._builder, self._name, self._frames = builder, name, frames
        self._times = builder.array(np.arange(frames)[:, None] / fps, "<f4", bounds=True)
        self._first: int | None = None
        self._channels: list[dict[str, Any]] = []
        self._samplers: list[dict[str, Any]] = []

    def track(self, node: int, path: str, values: np.ndarray) -> None:
        """``(frames, width)`` translations, scales, or rotations with w first, of a node; or one for all
        frames."""
        if path == "rotation":
            values = values[:, [1, 2, 3, 0]]
        times = self._times
        if len(values) < self._frames:
            if self._first is None:
                self._first = self._builder.array(np.zeros((1, 1)), "<f4", bounds=True)
            times = self._first
        self._channels.append({"sampler": len(self._samplers), "target": {"node": node, "path": path}})
        self._samplers.append({"input": times, "output": self._builder.array(values, "<f4")})

    def finished(self) -> dict[str, Any]:
        """The animation's JSON."""
        return {"name": self._name, "channels": self._channels, "samplers": self._samplers}


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
