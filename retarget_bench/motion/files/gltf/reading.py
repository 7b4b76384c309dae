"""A glTF file as a scene, and the motion in it."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from retarget_bench.motion.files.gltf import animation, humanoid, meshes
from retarget_bench.motion.files.gltf.document import Document, open_document
from retarget_bench.motion.files.gltf.tree import read_nodes
from retarget_bench.motion.files.scenes.reading import rigged
from retarget_bench.motion.files.scenes.scene import Piece, Scene, Surface
from retarget_bench.motion.files.scenes.tracks import Track
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
        self.nodes = read_nodes(document)

    # ----------------------------------------------------------------------------------------- bodies
    def roles(self, joints: Sequence[int]) -> Mapping[int, str]:  # noqa: ARG002
        return humanoid.roles(self.document)

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
        return meshes.surfaces(self.document)

    def pieces(self, surface: Surface) -> Iterator[Piece]:
        joints = None if surface.skin is None else len(self.skin_joints(surface.skin))
        return meshes.pieces(self.document, surface.number, joints)
