"""FBX files made by hand, binary and ASCII, and what they mean by matrices alone, without the reader."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.motion.gltf_files import NAMES, PARENTS, PLACES

TICKS = 46_186_158_000
"""Of FBX's time in a second."""
ORDERS = ("xyz", "xzy", "yzx", "yxz", "zxy", "zyx")
"""RotationOrder: axes in the order in which a joint is turned about them, all fixed."""
RATES = {30: 6, 24: 11, 60: 3, 120: 1, 25: 10}
"""Frames per second: TimeMode."""


@dataclass
class Node:
    """A record of the file format: name, properties, records in it."""

    name: str
    properties: list[Any] = field(default_factory=list)
    children: list[Node] = field(default_factory=list)


class Id(int):
    """A whole number of 64 bits."""


# ---------------------------------------------------------------------------------------- file formats
def binary(nodes: list[Node], version: int = 7400, *, packed: bool = True) -> bytes:
    """The records as a binary file; packed: arrays are compressed."""
    wide = version >= 7500
    head = b"Kaydara FBX Binary  \0\x1a\0" + struct.pack("<I", version)
    data = bytearray(head)
    for node in nodes:
        _record(data, node, wide, packed)
    data += b"\0" * (25 if wide else 13) + b"\0" * 16 + struct.pack("<I", version) + b"\0" * 120 + bytes(16)
    return bytes(data)


def _record(data: bytearray, node: Node, wide: bool, packed: bool) -> None:
    form = "<QQQB" if wide else "<IIIB"
    start = len(data)
    data += bytes(struct.calcsize(form)) + node.name.encode()
    properties = b"".join(_property(each, packed) for each in node.properties)
    data += properties
    for child in node.children:
        _record(data, child, wide, packed)
    if node.children:
        data += bytes(struct.calcsize(form))
    struct.pack_into(form, data, start, len(data), len(node.properties), len(properties), len(node.name))


def _property(value: Any, packed: bool) -> bytes:
    if isinstance(value, np.ndarray):
        code = {"f8": b"d", "f4": b"f", "i8": b"l", "i4": b"i"}[value.dtype.str[1:]]
        raw = value.astype(value.dtype.newbyteorder("<")).tobytes()
        stored = zlib.compress(raw) if packed else raw
        return code + struct.pack("<III", value.size, int(packed), len(stored)) + stored
    if isinstance(value, Id):
        return b"L" + struct.pack("<q", value)
    if isinstance(value, int):
        return b"I" + struct.pack("<i", value)
    if isinstance(value, float):
        return b"D" + struct.pack("<d", value)
    name, _, kind = value.partition("::")  # Model::Hips
    text = (f"{kind}\0\1{name}" if kind or value.endswith("::") else value).encode()
    return b"S" + struct.pack("<I", len(text)) + text


def ascii_text(nodes: list[Node], version: int = 7400) -> bytes:
    """The records as an ASCII file."""
    lines = [f"; FBX {version // 1000}.{version // 100 % 10}.0 project file", ""]
    for node in nodes:
        lines += _lines(node, "")
    return ("\n".join(lines) + "\n").encode()


def _lines(node: Node, indent: str) -> Iterator[str]:
    array = next((each for each in node.properties if isinstance(each, np.ndarray)), None)
    if array is not None:
        yield f"{indent}{node.name}: *{array.size} {{"
        yield f"{indent}\ta: {','.join(repr(each) for each in array.ravel().tolist())}"
        yield f"{indent}}}"
        return
    shown = ", ".join(
        f'"{each}"'
        if isinstance(each, str)
        else repr(float(each))
        if isinstance(each, float)
        else str(int(each))
        for each in node.properties
    )
    yield f"{indent}{node.name}: {shown}{' {' if node.children else ''}"
    for child in node.children:
        yield from _lines(child, indent + "\t")
    if node.children:
        yield f"{indent}}}"


# --------------------------------------------------------------------------------------------- content
@dataclass
class Joint:
    """A node: kind LimbNode, Null or Mesh; angles in degrees. inherit: 0 RrSs, 1 RSrs, 2 Rrs."""

    name: str
    parent: int = -1
    translation: np.ndarray = field(default_factory=lambda: np.zeros(3))
    rotation: np.ndarray = field(default_factory=lambda: np.zeros(3))
    scaling: np.ndarray = field(default_factory=lambda: np.ones(3))
    order: int = 0
    pre: np.ndarray = field(default_factory=lambda: np.zeros(3))
    post: np.ndarray = field(default_factory=lambda: np.zeros(3))
    pivot: np.ndarray = field(default_factory=lambda: np.zeros(3))
    kind: str = "LimbNode"
    inherit: int = 1


Curves = dict[tuple[int, str], tuple[np.ndarray, np.ndarray]]
"""(joint, T R or S) -> times (keys,) and values (keys, 3)."""


@dataclass
class Skin:
    """A mesh bound to joints. at: its node. bound: joint -> (4, 4) where it stood then, in the world."""

    at: int
    vertices: np.ndarray
    polygons: list[list[int]]
    weights: np.ndarray
    joints: list[int]
    bound: dict[int, np.ndarray]
    mesh: np.ndarray = field(default_factory=lambda: np.eye(4))


@dataclass
class Made:
    """An FBX file being made. axes: UpAxis, its sign, FrontAxis, its sign, CoordAxis, its sign."""

    joints: list[Joint]
    takes: dict[str, Curves] = field(default_factory=dict)
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    skins: list[Skin] = field(default_factory=list)
    centimetres: float = 1.0
    axes: tuple[int, ...] = (1, 1, 2, 1, 0, 1)
    fps: float = 30.0
    constant: bool = False
    mode: int | None = None
    characters: list[dict[str, int]] = field(default_factory=list)
    """Of HumanIK: link -> joint."""

    def nodes(self, version: int = 7400) -> list[Node]:
        objects, links = self._objects()
        return [
            Node(
                "FBXHeaderExtension", [], [Node("FBXHeaderVersion", [1003]), Node("FBXVersion", [version])]
            ),
            Node("GlobalSettings", [], [Node("Version", [1000]), self._settings()]),
            Node("Objects", [], objects),
            Node("Connections", [], links),
        ]

    def save(self, path: Path, *, version: int = 7400, ascii: bool = False, packed: bool = True) -> Path:
        nodes = self.nodes(version)
        path.write_bytes(ascii_text(nodes, version) if ascii else binary(nodes, version, packed=packed))
        return path

    def _settings(self) -> Node:
        names = ("UpAxis", "UpAxisSign", "FrontAxis", "FrontAxisSign", "CoordAxis", "CoordAxisSign")
        mode = RATES.get(int(self.fps), 14) if self.mode is None else self.mode
        return Node(
            "Properties70",
            [],
            [
                *(
                    Node("P", [name, "int", "Integer", "", value])
                    for name, value in zip(names, self.axes, strict=True)
                ),
                Node("P", ["UnitScaleFactor", "double", "Number", "", float(self.centimetres)]),
                Node("P", ["TimeMode", "enum", "", "", mode]),
                Node("P", ["CustomFrameRate", "double", "Number", "", float(self.fps)]),
            ],
        )

    def _objects(self) -> tuple[list[Node], list[Node]]:
        objects, links = [], []
        for number, joint in enumerate(self.joints):
            objects.append(_model(1000 + number, joint))
            parent = 1000 + joint.parent if joint.parent >= 0 else 0
            links.append(Node("C", ["OO", Id(1000 + number), Id(parent)]))
            if joint.kind == "LimbNode":
                own = [Id(20_000 + number), f"NodeAttribute::{joint.name}", "LimbNode"]
                objects.append(Node("NodeAttribute", own, [Node("TypeFlags", ["Skeleton"])]))
                links.append(Node("C", ["OO", Id(20_000 + number), Id(1000 + number)]))
        for number, skin in enumerate(self.skins):
            self._skin(number, skin, objects, links)
        for number, name in enumerate(self.takes):
            self._take(number, name, objects, links)
        for number, linked in enumerate(self.characters, 40_000):
            own = [Id(number), f"Constraint::Character{number}", "Character"]
            objects.append(Node("Constraint", own, [Node("Type", ["Character"]), Node("Version", [100])]))
            links += [Node("C", ["OP", Id(1000 + j), Id(number), f"{n}Link"]) for n, j in linked.items()]
        return objects, links

    def _skin(self, number: int, skin: Skin, objects: list[Node], links: list[Node]) -> None:
        base = 50_000 + 1000 * number
        corners = [corner for face in skin.polygons for corner in (*face[:-1], -face[-1] - 1)]
        mesh = [
            Node("Vertices", [np.asarray(skin.vertices, np.float64).ravel()]),
            Node("PolygonVertexIndex", [np.array(corners, np.int32)]),
            Node("GeometryVersion", [124]),
        ]
        objects.append(Node("Geometry", [Id(base), "Geometry::surface", "Mesh"], mesh))
        links.append(Node("C", ["OO", Id(base), Id(1000 + skin.at)]))
        if not skin.joints:
            return
        objects.append(Node("Deformer", [Id(base + 1), "Deformer::skin", "Skin"], [Node("Version", [101])]))
        links.append(Node("C", ["OO", Id(base + 1), Id(base)]))
        for column, joint in enumerate(skin.joints):
            own = np.flatnonzero(skin.weights[:, column])
            bound = skin.bound[joint]
            cluster = [
                Node("Version", [100]),
                Node("Indexes", [own.astype(np.int32)]),
                Node("Weights", [skin.weights[own, column].astype(np.float64)]),
                Node("Transform", [(np.linalg.inv(bound) @ skin.mesh).T.ravel()]),
                Node("TransformLink", [bound.T.ravel()]),
            ]
            name = f"SubDeformer::cluster{column}"
            objects.append(Node("Deformer", [Id(base + 2 + column), name, "Cluster"], cluster))
            links.append(Node("C", ["OO", Id(base + 2 + column), Id(base + 1)]))
            links.append(Node("C", ["OO", Id(1000 + joint), Id(base + 2 + column)]))

    def _take(self, number: int, name: str, objects: list[Node], links: list[Node]) -> None:
        base = 1_000_000 * (number + 1)
        curves = self.takes[name]
        last = max((float(times[-1]) for times, _ in curves.values() if len(times)), default=0.0)
        begin, end = self.ranges.get(name, (0.0, last))
        spans = [
            Node("P", [key, "KTime", "Time", "", Id(round(time * TICKS))])
            for key, time in (("LocalStart", begin), ("LocalStop", end))
        ]
        objects.append(
            Node("AnimationStack", [Id(base), f"AnimStack::{name}", ""], [Node("Properties70", [], spans)])
        )
        objects.append(
            Node("AnimationLayer", [Id(base + 1), "AnimLayer::BaseLayer", ""], [Node("Version", [1])])
        )
        links.append(Node("C", ["OO", Id(base + 1), Id(base)]))
        following = base + 2
        for (joint, path), (times, values) in curves.items():
            following = self._curves(following, base + 1, joint, path, times, values, objects, links)

    def _curves(
        self,
        first: int,
        layer: int,
        joint: int,
        path: str,
        times: np.ndarray,
        values: np.ndarray,
        objects: list[Node],
        links: list[Node],
    ) -> int:
        """A curve for each axis; returns the next free id."""
        channels = [
            Node("P", [f"d|{axis}", "Number", "", "A", float(value)])
            for axis, value in zip("XYZ", values[0], strict=True)
        ]
        objects.append(
            Node(
                "AnimationCurveNode",
                [Id(first), f"AnimCurveNode::{path}", ""],
                [Node("Properties70", [], channels)],
            )
        )
        links.append(Node("C", ["OO", Id(first), Id(layer)]))
        prop = {"T": "Lcl Translation", "R": "Lcl Rotation", "S": "Lcl Scaling"}[path]
        links.append(Node("C", ["OP", Id(first), Id(1000 + joint), prop]))
        ticks = np.round(np.asarray(times) * TICKS).astype(np.int64)
        for axis in range(3):
            body = [
                Node("Default", [float(values[0, axis])]),
                Node("KeyVer", [4008]),
                Node("KeyTime", [ticks]),
                Node("KeyValueFloat", [values[:, axis].astype(np.float32)]),
                Node("KeyAttrFlags", [np.array([2 if self.constant else 4], np.int32)]),
                Node("KeyAttrDataFloat", [np.zeros(4, np.float32)]),
                Node("KeyAttrRefCount", [np.array([len(ticks)], np.int32)]),
            ]
            objects.append(Node("AnimationCurve", [Id(first + 1 + axis), "AnimCurve::", ""], body))
            links.append(Node("C", ["OP", Id(first + 1 + axis), Id(first), f"d|{'XYZ'[axis]}"]))
        return first + 4


def _model(number: int, joint: Joint) -> Node:
    def vector(name: str, kind: str, more: str, values: np.ndarray) -> Node:
        return Node("P", [name, kind, more, "A" if kind == name else "", *(float(each) for each in values)])

    properties = [
        vector("Lcl Translation", "Lcl Translation", "", joint.translation),
        vector("Lcl Rotation", "Lcl Rotation", "", joint.rotation),
        vector("Lcl Scaling", "Lcl Scaling", "", joint.scaling),
        Node("P", ["RotationActive", "bool", "", "", 1]),
        Node("P", ["RotationOrder", "enum", "", "", joint.order]),
        Node("P", ["InheritType", "enum", "", "", joint.inherit]),
        vector("PreRotation", "Vector3D", "Vector", joint.pre),
        vector("PostRotation", "Vector3D", "Vector", joint.post),
        vector("RotationPivot", "Vector3D", "Vector", joint.pivot),
        vector("ScalingPivot", "Vector3D", "Vector", joint.pivot),
    ]
    return Node(
        "Model",
        [Id(number), f"Model::{joint.name}", joint.kind],
        [Node("Version", [232]), Node("Properties70", [], properties)],
    )


# --------------------------------------------------------------------------------------------- meaning
def turn(angles: np.ndarray, order: int = 0) -> np.ndarray:
    """``(4, 4)`` of Euler angles in degrees."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler(
        ORDERS[order], [angles["xyz".index(a)] for a in ORDERS[order]], True
    ).as_matrix()
    return matrix


def moved(by: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = by
    return matrix


def local(joint: Joint, changed: dict[str, np.ndarray] | None = None) -> np.ndarray:
    """``(4, 4)`` by the formula of FBX for the transform of a node."""
    values = {"T": joint.translation, "R": joint.rotation, "S": joint.scaling} | (changed or {})
    scale = np.diag([*values["S"], 1.0])
    turned = turn(joint.pre) @ turn(values["R"], joint.order) @ np.linalg.inv(turn(joint.post))
    about = moved(joint.pivot) @ turned @ scale @ moved(-joint.pivot)
    return moved(values["T"]) @ about


def world(scene: Made, take: str | None = None, time: float = 0.0) -> np.ndarray:
    """``(joints, 4, 4)`` of all nodes, at a time of a take whose keys are connected linearly."""
    changes: dict[int, dict[str, np.ndarray]] = {}
    for (joint, path), (times, values) in (scene.takes[take] if take else {}).items():
        stored = values.astype(np.float32).astype(float)
        at = np.array([np.interp(time, times, column) for column in stored.T])
        changes.setdefault(joint, {})[path] = at
    transforms: list[np.ndarray] = []
    for number, joint in enumerate(scene.joints):
        own = local(joint, changes.get(number))
        if (
            joint.inherit == 2 and joint.parent >= 0
        ):  # the parent's scale, all directions alike, is left out
            own[:3, :3] /= scene.joints[joint.parent].scaling[0]
        transforms.append(transforms[joint.parent] @ own if joint.parent >= 0 else own)
    return np.stack(transforms)


def pivots(scene: Made, standing: np.ndarray) -> np.ndarray:
    """``(joints, 3)`` the points in the world that the joints turn about."""
    own = np.stack([joint.pivot for joint in scene.joints])
    return np.einsum("jab,jb->ja", standing[:, :3, :3], own) + standing[:, :3, 3]


def skinned(skin: Skin, standing: np.ndarray) -> np.ndarray:
    """``(vertices, 3)`` vertex by vertex, as the joints carry what was bound to them."""
    vertices = np.zeros_like(skin.vertices)
    for vertex, place in enumerate(skin.vertices):
        for column, joint in enumerate(skin.joints):
            carried = standing[joint] @ np.linalg.inv(skin.bound[joint]) @ skin.mesh
            vertices[vertex] += skin.weights[vertex, column] * (carried @ np.append(place, 1.0))[:3]
    return vertices


def person(
    random: np.random.Generator,
    *,
    frames: int = 12,
    fps: float = 30.0,
    size: float = 100.0,
    above: tuple[Joint, ...] = (),
    turned: bool = True,
    skin: bool = True,
) -> Made:
    """A person with a skin who moves as chance has it in the take ``act``.

    size: units of the file in a metre. above: nodes above the hips.
    turned: joints have pre-rotations, and angles at rest that are no rest.
    """
    joints = list(above)
    first = len(joints)
    for number, name in enumerate(NAMES):
        parent = PARENTS[number]
        away = PLACES[number] - (PLACES[parent] if parent >= 0 else 0)
        pre = random.uniform(-180, 180, 3) if turned else np.zeros(3)
        joints.append(
            Joint(
                name,
                first + parent if parent >= 0 else first - 1,
                away * size,
                random.uniform(-20, 20, 3) if turned else np.zeros(3),
                order=int(random.integers(0, 6)),
                pre=pre,
                inherit=1,
            )
        )
    scene = Made(joints, fps=fps)
    stand_up(scene, first, size)
    times = np.arange(frames) / fps
    curves: Curves = {}
    for number in range(first, len(joints)):
        steps = np.cumsum(random.normal(scale=6.0, size=(frames, 3)), axis=0)
        curves[number, "R"] = times, joints[number].rotation + steps
    steps = np.cumsum(random.normal(scale=0.01 * size, size=(frames, 3)), axis=0)
    curves[first, "T"] = times, joints[first].translation + steps
    scene.takes["act"] = curves
    if skin:
        dress(scene, random, first)
    return scene


def stand_up(scene: Made, first: int, size: float) -> None:
    """Translations with which the joints stand in a T-pose in the world at rest, whatever turns them."""
    for number in range(first, len(scene.joints)):
        joint = scene.joints[number]
        standing = world(Made(scene.joints[:number])) if number else np.zeros((0, 4, 4))
        above = standing[joint.parent] if joint.parent >= 0 else np.eye(4)
        place = np.append(PLACES[number - first] * size, 1.0)
        joint.translation = (np.linalg.inv(above) @ place)[:3]


def dress(scene: Made, random: np.random.Generator, first: int) -> None:
    """A skin of chance polygons on the joints from ``first`` on, bound as they stand at rest."""
    standing = world(scene)
    scene.joints.append(Joint("surface", -1, kind="Mesh"))
    joints = list(range(first, first + len(NAMES)))
    weights = random.uniform(size=(24, len(joints))) * (random.uniform(size=(24, len(joints))) < 0.2)
    weights[:, 0] += 0.1
    weights /= weights.sum(axis=1, keepdims=True)
    order = random.permutation(24)
    polygons = [order[:3].tolist(), order[3:7].tolist(), order[7:12].tolist(), order[12:15].tolist()]
    space = np.diag([2.0, 2.0, 2.0, 1.0])  # the mesh has a space of its own
    space[:3, :3] = space[:3, :3] @ Rotation.random(random_state=random).as_matrix()
    bound = {joint: standing[joint] for joint in joints}
    at = len(scene.joints) - 1
    scene.skins.append(
        Skin(at, random.normal(scale=50, size=(24, 3)), polygons, weights, joints, bound, space)
    )
