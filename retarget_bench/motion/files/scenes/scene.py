"""The interface of files with a tree of nodes to the rules that find bodies in them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion.files.scenes.nodes import Nodes
from retarget_bench.motion.files.scenes.tracks import Track


@dataclass(frozen=True)
class Surface:
    """A mesh at a node. skin: the number of the skin that it follows; None: it goes with its node.

    number: of the mesh among those of the file.
    """

    node: int
    number: int
    skin: int | None


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of a mesh.

    vertices: ``(vertices, 3)`` in the space where bind matrices begin; without a skin in the node's.
    faces:    ``(faces, 3)`` indices of these vertices.
    weights:  ``(vertices, joints of the skin)`` shares that sum to 1; None without a skin.
    """

    vertices: np.ndarray
    faces: np.ndarray
    weights: np.ndarray | None


class Scene(ABC):
    """The content of a file: nodes, skins, takes and meshes, each by number.

    path: for messages. nodes: as they stand at rest. unit, up: as in ``Recording``.
    kind: what the format calls a take ("animation").
    Raises FileError, with the path and what is wrong, for whatever a reader needs and the file lacks.
    """

    path: Path
    nodes: Nodes
    unit: str
    up: str
    kind: str

    def fail(self, problem: str) -> FileError:
        """The error to raise: ``problem`` is the rest of a sentence about the file."""
        return FileError(self.path, problem)

    # ----------------------------------------------------------------------------------------- bodies
    def roles(self, joints: Sequence[int]) -> Mapping[int, str]:  # noqa: ARG002
        """Node -> role, where the file states what the joints of a body are."""
        return {}

    @property
    @abstractmethod
    def skins(self) -> Sequence[str]:
        """A name for each group of joints that belong together: of skins, and of bones where a format has
        such nodes."""

    @abstractmethod
    def skin_joints(self, number: int) -> list[int]:
        """The nodes of a skin."""

    @abstractmethod
    def bind_matrices(self, number: int) -> np.ndarray | None:
        """``(joints, 4, 4)`` from a mesh's space to its joints' in the pose in which it was bound to them;
        None: not stated."""

    def bind_turn(self, number: int) -> np.ndarray | None:  # noqa: ARG002
        """``(4,)`` how the mesh's space stood in the world when it was bound; None: not stated."""
        return None

    @abstractmethod
    def is_tip(self, node: int) -> bool:
        """Whether a node is nothing but a place: it has no child, mesh, camera or the like."""

    def shown(self) -> set[int]:
        """The nodes of the scene that the file shows, where it has several."""
        return set()

    # ------------------------------------------------------------------------------------------ takes
    @property
    @abstractmethod
    def take_names(self) -> tuple[str, ...]:
        """The names of the takes, "" for one without."""

    @abstractmethod
    def animated(self, number: int) -> Iterable[int]:
        """The nodes that a take turns or moves."""

    @abstractmethod
    def spread(self, node: int, path: str) -> float:
        """The largest range that a component of a node's translation or rotation (as a quaternion) has in a
        take."""

    @abstractmethod
    def tracks(self, number: int, only: Container[int]) -> list[Track]:
        """The tracks of a take that move, turn and scale some nodes."""

    def preferred(self, only: Container[int]) -> Iterable[int]:  # noqa: ARG002
        """The takes, in the order in which the first with tracks on these nodes is read."""
        return range(len(self.take_names))

    @abstractmethod
    def frame_times(self, number: int | None, tracks: Iterable[Track]) -> tuple[np.ndarray, float, str]:
        """The times ``(frames,)`` to sample the tracks of a take at, the frames per second, and how these
        were found. number: None where no take is read."""

    # ----------------------------------------------------------------------------------------- meshes
    @abstractmethod
    def surfaces(self) -> list[Surface]:
        """The meshes at nodes."""

    @abstractmethod
    def pieces(self, surface: Surface) -> Iterator[Piece]:
        """The parts of a mesh that are made of triangles."""
