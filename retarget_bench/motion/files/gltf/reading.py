"""A glTF file as a scene, and the motion in it."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.files.gltf import animation
from retarget_bench.motion.files.gltf.document import Document, open_document
from retarget_bench.motion.files.scenes.reading import rigged
from retarget_bench.motion.files.scenes.roles import SEGMENTS, roles_of
from retarget_bench.motion.files.scenes.scene import (
    DEEPEST,
    MOST_NODES,
    Nodes,
    Piece,
    Scene,
    Surface,
    Track,
    decomposed,
    shares_of_one,
)
from retarget_bench.motion.recording import Recording


def read(path: Path, take: str | None = None, body: str | None = None) -> Recording:
    """The motion of a body in a file, in metres and Y up as the format prescribes.

    take: the animation, by name or number from 1 on; None: the first that moves the body. body: likewise,
        by the name of its root.
    Raises FileError for what cannot be read, NotSupported where there is no such animation or body.
    """
    return rigged(GltfScene(open_document(path)), take, body)[1]


def takes(path: Path) -> tuple[str, ...]:
    """The names of a file's animations, "" for those without one. Raises FileError."""
    return animation.take_names(open_document(path))


class GltfScene(Scene):
    """The nodes, skins, animations and meshes of a glTF document. Raises FileError where the nodes are
    damaged, and for other parts when they are read."""

    unit, up, kind = "m", "y", "animation"

    def __init__(self, document: Document) -> None:
        self.document, self.path = document, document.path
        self.nodes = _nodes(document)

    # ----------------------------------------------------------------------------------------- bodies
    def roles(self, joints: Sequence[int]) -> Mapping[int, str]:  # noqa: ARG002
        return _roles(self.document)

    @property
    def skins(self) -> Sequence[str]:
        return [f"skins[{number}]" for number in range(len(self.document.items("skins")))]

    def skin_joints(self, number: int) -> list[int]:
        skin = self.document.item("skins", number, "a node")
        joints: list[int] = self.document.listed(skin, "joints", f"skins[{number}]", int)
        for joint in joints:
            self.document.item("nodes", joint, f"skins[{number}]")
        return joints

    def bind_matrices(self, number: int) -> np.ndarray | None:
        item = self.document.items("skins")[number]
        if item.get("inverseBindMatrices") is None:
            return None
        count = len(self.skin_joints(number))
        matrices = self.document.array(item["inverseBindMatrices"], ("MAT4",), f"skins[{number}]")
        if len(matrices) < count:
            raise self.fail(f"skins[{number}] has {len(matrices)} bind matrices for {count} joints")
        if np.abs(matrices[:count]).max(initial=0.0) > 1e9:
            raise self.fail(f"skins[{number}] has bind matrices above 1e+09")
        return np.asarray(matrices[:count], dtype=np.float64).reshape(count, 4, 4).transpose(0, 2, 1)

    def is_tip(self, node: int) -> bool:
        item = self.document.items("nodes")[node]
        return not self.nodes.children[node] and not {"mesh", "camera", "skin", "extensions"} & item.keys()

    def shown(self) -> set[int]:
        document = self.document
        scenes = document.items("scenes")
        if not scenes:
            return set()
        number = document.integer(document.content, "scene", "the file", 0)
        top = document.listed(
            document.item("scenes", number, "the file"), "nodes", f"scenes[{number}]", int
        )
        for node in top:
            document.item("nodes", node, f"scenes[{number}]")
        return {below for node in dict.fromkeys(top) for below in self.nodes.below(node)}

    # ------------------------------------------------------------------------------------------ takes
    @property
    def take_names(self) -> tuple[str, ...]:
        return animation.take_names(self.document)

    def animated(self, number: int) -> Iterable[int]:
        return animation.animated(self.document, number)

    def spread(self, node: int, path: str) -> float:
        return max(
            (
                float(np.ptp(track.keyed, axis=0).max())
                for number in range(len(self.take_names))
                for track in animation.tracks(self.document, number, {node})
                if track.path == path
            ),
            default=0.0,
        )

    def tracks(self, number: int, only: Container[int]) -> list[Track]:
        return animation.tracks(self.document, number, only)

    def frame_times(self, number: int | None, tracks: Iterable[Track]) -> tuple[np.ndarray, float, str]:  # noqa: ARG002
        return animation.frame_times(self.document, tracks)

    # ----------------------------------------------------------------------------------------- meshes
    def surfaces(self) -> list[Surface]:
        return _surfaces(self.document)

    def pieces(self, surface: Surface) -> Iterator[Piece]:
        joints = None if surface.skin is None else len(self.skin_joints(surface.skin))
        return _pieces(self.document, surface.number, joints)


def _nodes(document: Document) -> Nodes:
    """The nodes of a file. Raises FileError where they form no forest, or a transform is not finite."""
    items = document.items("nodes")
    count = len(items)
    if count > MOST_NODES:
        raise document.fail(f"has {count} nodes; files of up to {MOST_NODES} are read")
    parents, children = [-1] * count, []
    for number, item in enumerate(items):
        below = document.listed(item, "children", f"nodes[{number}]", int)
        for child in below:
            document.item("nodes", child, f"nodes[{number}]")
            if parents[child] >= 0:
                raise document.fail(f"nodes[{child}] is a child of two nodes: the file is damaged")
            parents[child] = number
        children.append(below)
    depths = _depths(document, parents, children)
    if max(depths, default=0) > DEEPEST:
        raise document.fail(f"has nodes {max(depths)} deep; up to {DEEPEST} are read: it is damaged")
    translation = np.zeros((count, 3))
    turned, scale = rotation.identity(count), np.ones((count, 3))
    for number, item in enumerate(items):
        name = f"nodes[{number}]"
        if (matrix := document.numbers(item, "matrix", 16, name)) is not None:
            parts = decomposed(matrix.reshape(4, 4).T)
            translation[number], turned[number], scale[number] = parts
        if (value := document.numbers(item, "translation", 3, name)) is not None:
            translation[number] = value
        if (value := document.numbers(item, "rotation", 4, name)) is not None:
            turned[number] = value[[3, 0, 1, 2]]
        if (value := document.numbers(item, "scale", 3, name)) is not None:
            scale[number] = value
    return Nodes(document.names, parents, children, depths, translation, rotation.normalise(turned), scale)


def _depths(document: Document, parents: list[int], children: list[list[int]]) -> list[int]:
    """Steps of every node from the top. Raises FileError where nodes form a circle."""
    depths = [-1] * len(parents)
    waiting = [node for node, parent in enumerate(parents) if parent < 0]
    for node in waiting:
        depths[node] = 0
    while waiting:
        node = waiting.pop()
        for child in children[node]:
            depths[child] = depths[node] + 1
            waiting.append(child)
    if -1 in depths:
        raise document.fail(f"nodes[{depths.index(-1)}] stands below itself: its nodes form a circle")
    return depths


_SPINE = ("spine", "chest", "upperChest")
_THUMB = ("metacarpal", "proximal", "distal")
"""Of VRM 1.0; VRM 0.x names a thumb as the other fingers."""


def _roles(document: Document) -> dict[int, str]:
    """Node -> role, as a humanoid map of VRM states it (specifications of VRM 0.x and 1.0 and of VRM
    animations); empty where the file has none. Raises FileError where it is damaged."""
    extensions = document.inside(document.content, "extensions", "the file")
    name = next((each for each in ("VRMC_vrm", "VRMC_vrm_animation", "VRM") if each in extensions), None)
    if name is None:
        return {}
    humanoid = document.inside(document.inside(extensions, name, "the file"), "humanoid", name)
    if name == "VRM":  # has a list of bones, VRM 1.0 an object
        bones = [(each.get("bone"), each) for each in document.listed(humanoid, "humanBones", name)]
    else:
        table = document.inside(humanoid, "humanBones", name)
        bones = [(bone, document.inside(table, bone, name)) for bone in table]
    nodes: dict[str, int] = {}
    for bone, entry in bones:
        node = document.integer(entry, "node", f"{name} humanBones")
        document.item("nodes", node, name)
        nodes.setdefault(str(bone), node)
    spine = [bone for bone in _SPINE if bone in nodes]
    role_of = roles_of(nodes, spine, ["neck"], SEGMENTS if name == "VRM" else _THUMB)
    return {node: role_of[bone] for bone, node in reversed(nodes.items()) if bone in role_of}


_TRIANGLES, _STRIP, _FAN = 4, 5, 6


def _surfaces(document: Document) -> list[Surface]:
    """The meshes at the nodes of a file. Raises FileError for numbers that there are not."""
    surfaces = []
    for node, item in enumerate(document.items("nodes")):
        if (mesh := item.get("mesh")) is not None:
            document.item("meshes", mesh, f"nodes[{node}]")
            if (skin := item.get("skin")) is not None:
                document.item("skins", skin, f"nodes[{node}]")
            surfaces.append(Surface(node, mesh, skin))
    return surfaces


def _pieces(document: Document, number: int, joints: int | None) -> Iterator[Piece]:
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
    return shares_of_one(weights)


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
