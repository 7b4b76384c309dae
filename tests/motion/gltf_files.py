"""glTF files made by hand, and what they mean by matrices alone, without the reader and the writer."""

from __future__ import annotations

import base64
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


@dataclass
class Made:
    """A glTF file being made: its JSON and its only buffer."""

    content: dict[str, Any] = field(default_factory=lambda: {"asset": {"version": "2.0"}})
    data: bytearray = field(default_factory=bytearray)

    def add(self, key: str, item: dict[str, Any]) -> int:
        self.content.setdefault(key, []).append(item)
        return len(self.content[key]) - 1

    def view(self, data: bytes, **more: Any) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        item = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more}
        self.data += data
        return self.add("bufferViews", item)

    def array(self, values: Any, kind: str = "f4", **more: Any) -> int:
        """An accessor; ``more`` goes into its JSON."""
        values = np.asarray(values, dtype=f"<{kind}")
        values = values.reshape(len(values), -1)
        item = {"bufferView": self.view(values.tobytes()), "componentType": CODES[kind]}
        if kind == "f4" and len(values):
            item |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        return self.add("accessors", item | {"count": len(values), "type": TYPES[values.shape[1]], **more})

    def animate(
        self, name: str, tracks: dict[tuple[int, str], tuple[Any, Any]], how: str = "LINEAR"
    ) -> None:
        """Tracks: (node, path) -> times and values, or the numbers of their accessors."""
        channels, samplers = [], []
        for (node, path), track in tracks.items():
            times, values = (x if isinstance(x, int) else self.array(x) for x in track)
            channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
            samplers.append({"input": times, "output": values, "interpolation": how})
        self.add("animations", {"name": name, "channels": channels, "samplers": samplers})

    def bytes(self) -> bytes:
        """The file as GLB."""
        self.content["buffers"] = [{"byteLength": len(self.data)}]
        return packed(self.content, bytes(self.data))

    def save(self, path: Path, *, linked: str = "") -> Path:
        """As GLB; or as ``.gltf`` with its buffer as a ``data:`` URI or in the file ``linked``."""
        if path.suffix == ".glb":
            path.write_bytes(self.bytes())
            return path
        uri = linked or f"data:application/octet-stream;base64,{base64.b64encode(self.data).decode()}"
        if linked:
            (path.parent / linked).write_bytes(self.data)
        self.content["buffers"] = [{"byteLength": len(self.data), "uri": uri}]
        path.write_text(json.dumps(self.content))
        return path


def packed(content: dict[str, Any], data: bytes) -> bytes:
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def unpacked(path: Path) -> tuple[dict[str, Any], bytes]:
    """JSON and buffer of a GLB file."""
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    binary = struct.unpack_from("<I", data, 20 + size)[0]
    return json.loads(data[20 : 20 + size]), data[28 + size : 28 + size + binary]


def matrix(node: dict[str, Any], changed: dict[str, Any] | None = None) -> np.ndarray:
    """``(4, 4)`` a node's local transform, with some of its properties changed."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=float).reshape(4, 4).T
    node = node | (changed or {})
    transform = np.eye(4)
    turn = Rotation.from_quat(node.get("rotation", [0, 0, 0, 1])).as_matrix()
    transform[:3, :3] = turn * np.array(node.get("scale", [1, 1, 1]))
    transform[:3, 3] = node.get("translation", [0, 0, 0])
    return transform


def world(asset: Made, changed: dict[int, dict[str, Any]] | None = None) -> list[np.ndarray]:
    """Every node's transform in the world, by going up from it."""
    nodes = asset.content["nodes"]
    parent = {child: number for number, node in enumerate(nodes) for child in node.get("children", [])}
    transforms = []
    for number in range(len(nodes)):
        total, node = np.eye(4), number
        while True:
            total = matrix(nodes[node], (changed or {}).get(node)) @ total
            if node not in parent:
                break
            node = parent[node]
        transforms.append(total)
    return transforms


def values_of(asset: Made, accessor: int) -> np.ndarray:
    """The numbers of a plain accessor of a file made here."""
    item = asset.content["accessors"][accessor]
    view = asset.content["bufferViews"][item["bufferView"]]
    width = {name: size for size, name in TYPES.items()}[item["type"]]
    kind = {code: name for name, code in CODES.items()}[item["componentType"]]
    flat = np.frombuffer(bytes(asset.data), f"<{kind}", item["count"] * width, view["byteOffset"])
    return flat.reshape(-1, width).astype(float)


def at(asset: Made, animation: int, time: float) -> dict[int, dict[str, Any]]:
    """Node -> its properties at a time of an animation with LINEAR samplers."""
    item = asset.content["animations"][animation]
    by_node: dict[int, dict[str, Any]] = {}
    for channel in item["channels"]:
        sampler = item["samplers"][channel["sampler"]]
        if channel["target"]["path"] == "weights":
            continue
        times = values_of(asset, sampler["input"])[:, 0]
        values = values_of(asset, sampler["output"])
        time_ = float(np.clip(time, times[0], times[-1]))
        node, path = channel["target"]["node"], channel["target"]["path"]
        if len(times) == 1:
            value = values[0]
        elif path == "rotation":
            value = Slerp(times, Rotation.from_quat(values))(time_).as_quat()
        else:
            value = np.array([np.interp(time_, times, column) for column in values.T])
        by_node.setdefault(node, {})[path] = value.tolist()
    return by_node


def skinned(asset: Made, mesh_node: int, transforms: list[np.ndarray]) -> np.ndarray:
    """``(vertices, 3)`` by the formula of the specification (section 3.7.3.3), vertex by vertex."""
    node = asset.content["nodes"][mesh_node]
    skin = asset.content["skins"][node["skin"]]
    attributes = asset.content["meshes"][node["mesh"]]["primitives"][0]["attributes"]
    places, joints, weights = (
        values_of(asset, attributes[name]) for name in ("POSITION", "JOINTS_0", "WEIGHTS_0")
    )
    bound = values_of(asset, skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
    vertices = np.zeros((len(places), 3))
    for vertex, place in enumerate(places):
        for joint, share in zip(joints[vertex].astype(int), weights[vertex], strict=True):
            moved = transforms[skin["joints"][joint]] @ bound[joint] @ np.append(place, 1.0)
            vertices[vertex] += share * moved[:3]
    return vertices


NAMES = (
    *("Hips", "Spine", "Neck", "Head"),
    *("LeftArm", "LeftForeArm", "LeftHand", "RightArm", "RightForeArm", "RightHand"),
    *("LeftUpLeg", "LeftLeg", "LeftFoot", "RightUpLeg", "RightLeg", "RightFoot"),
)
ROLES = (
    *("hips", "spine_1", "neck", "head"),
    *("left_arm", "left_forearm", "left_hand", "right_arm", "right_forearm", "right_hand"),
    *("left_up_leg", "left_leg", "left_foot", "right_up_leg", "right_leg", "right_foot"),
)
PARENTS = (-1, 0, 1, 2, 1, 4, 5, 1, 7, 8, 0, 10, 11, 0, 13, 14)
PLACES = np.array(
    [
        *([0, 0.95, 0], [0, 1.2, 0], [0, 1.45, 0], [0, 1.6, 0]),
        *([0.2, 1.4, 0], [0.5, 1.4, 0], [0.75, 1.4, 0], [-0.2, 1.4, 0], [-0.5, 1.4, 0], [-0.75, 1.4, 0]),
        *([0.1, 0.9, 0], [0.1, 0.5, 0], [0.1, 0.08, 0], [-0.1, 0.9, 0], [-0.1, 0.5, 0], [-0.1, 0.08, 0]),
    ]
)
"""A person in a T-pose, metres."""


def person(
    random: np.random.Generator,
    *,
    frames: int = 12,
    fps: float = 30.0,
    size: float = 1.0,
    above: tuple[dict[str, Any], ...] = ({},),
    turned: bool = True,
    skin: bool = True,
) -> Made:
    """A person with a skin, who moves as chance has it in the animation ``act``.

    size: units of the file in a metre. above: nodes above the hips, from the top down. turned: joint frames
    are turned anyhow at rest, else parallel to the world.
    """
    asset = Made()
    for number, node in enumerate(above):
        asset.add("nodes", {"name": f"above_{number}", **node, "children": [number + 1]})
    first = len(above)
    standing = np.linalg.inv(world(Made({"nodes": [*asset.content.get("nodes", []), {}]}))[first])
    if np.linalg.det(standing) < 0:  # the whole person is mirrored
        standing = np.eye(4)
    own = [Rotation.random(random_state=random) if turned else Rotation.identity() for _ in NAMES]
    globals_ = []
    for joint, name in enumerate(NAMES):
        expected = np.eye(4)
        expected[:3, :3], expected[:3, 3] = own[joint].as_matrix(), PLACES[joint] * size
        globals_.append(expected)
        local = (standing if not joint else np.linalg.inv(globals_[PARENTS[joint]])) @ expected
        node: dict[str, Any] = {"name": name}
        if not joint and above != ({},):
            scale = np.linalg.norm(local[:3, :3], axis=0)
            local[:3, :3] /= scale
        node["rotation"] = Rotation.from_matrix(local[:3, :3]).as_quat().tolist()
        node["translation"] = local[:3, 3].tolist()
        children = [first + n for n, parent in enumerate(PARENTS) if parent == joint]
        asset.add("nodes", node | ({"children": children} if children else {}))
    asset.content["scenes"] = [{"nodes": [0]}]
    tracks: dict[tuple[int, str], tuple[Any, Any]] = {}
    times = asset.array(np.arange(frames) / fps)
    for joint in range(len(NAMES)):
        rest = Rotation.from_quat(asset.content["nodes"][first + joint]["rotation"])
        steps = np.cumsum(random.normal(scale=0.1, size=(frames, 3)), axis=0)
        tracks[first + joint, "rotation"] = (
            times,
            asset.array((rest * Rotation.from_rotvec(steps)).as_quat()),
        )
    place = np.array(asset.content["nodes"][first]["translation"])
    steps = np.cumsum(random.normal(scale=0.01 * np.abs(place).max(), size=(frames, 3)), axis=0)
    tracks[first, "translation"] = times, asset.array(place + steps)
    if frames:
        asset.animate("act", tracks)
    if skin:
        dress(asset, random, first)
    return asset


def dress(asset: Made, random: np.random.Generator, first: int) -> None:
    """A skin of chance triangles on the joints from node ``first`` on, bound in the pose at rest."""
    joints = list(range(first, first + len(NAMES)))
    standing = world(asset)
    space = np.diag([2.0, 2.0, 2.0, 1.0])  # the mesh has a space of its own
    space[:3, :3] = space[:3, :3] @ Rotation.random(random_state=random).as_matrix()
    bound = np.stack([np.linalg.inv(standing[joint]) @ space for joint in joints])
    places = random.normal(size=(24, 3))
    weights = random.uniform(size=(24, 4)).astype("<f4")
    weights /= weights.sum(axis=1, keepdims=True)
    attributes = {
        "POSITION": asset.array(places),
        "JOINTS_0": asset.array(random.integers(0, len(NAMES), (24, 4)), "u1"),
        "WEIGHTS_0": asset.array(weights),
    }
    indices = asset.array(random.permutation(24), "u2")
    mesh = asset.add("meshes", {"primitives": [{"attributes": attributes, "indices": indices}]})
    matrices = asset.array(bound.transpose(0, 2, 1).reshape(-1, 16))
    skin = asset.add("skins", {"joints": joints, "inverseBindMatrices": matrices})
    node = asset.add("nodes", {"name": "surface", "mesh": mesh, "skin": skin})
    asset.content["scenes"][0]["nodes"].append(node)
