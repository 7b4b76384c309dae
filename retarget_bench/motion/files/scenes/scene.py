"""The content of a file with a tree of nodes: the nodes at rest, what moves them, skins and meshes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion import rotation

MOST_NODES = 100_000
"""Files with more are not read."""
DEEPEST = 10_000
"""Likewise with a node below so many others."""
UNIFORM = 1e-4
"""Share by which the three scales of a node may differ and still count as one."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """The nodes of a file.

    names:       of the nodes.
    parents:     per node its parent, -1 for those at the top.
    children:    per node its children.
    depths:      steps from the top.
    translation: ``(nodes, 3)``, rotation: ``(nodes, 4)`` w first, scale: ``(nodes, 3)``: the local
                 transform at rest, in the file's unit.
    """

    names: tuple[str, ...]
    parents: list[int]
    children: list[list[int]]
    depths: list[int]
    translation: np.ndarray
    rotation: np.ndarray
    scale: np.ndarray

    def above(self, node: int) -> list[int]:
        """The nodes above a node, from the top down."""
        ancestors = []
        while (node := self.parents[node]) >= 0:
            ancestors.append(node)
        return ancestors[::-1]

    def below(self, node: int) -> list[int]:
        """A node and all below it, parents first, in the file's order of children."""
        nodes, waiting = [], [node]
        while waiting:
            nodes.append(each := waiting.pop())
            waiting.extend(reversed(self.children[each]))
        return nodes

    @cached_property
    def tops(self) -> list[int]:
        """Per node the top of the tree that it stands in."""
        tops = list(range(len(self.parents)))
        for node in sorted(tops, key=self.depths.__getitem__):
            if (parent := self.parents[node]) >= 0:
                tops[node] = tops[parent]
        return tops

    def meeting(self, nodes: Iterable[int]) -> int:
        """The lowest node that has all of these at or below it; -1 where they stand in separate trees."""
        first, *others = nodes
        way = [*self.above(first), first]
        lowest, visited, own = len(way) - 1, set(way), set(way)
        for node in others:
            while node not in visited:
                visited.add(node)
                if (node := self.parents[node]) < 0:
                    return -1
            if node in own:
                lowest = min(lowest, self.depths[node])
        return way[lowest]

    def matrices(self, nodes: Iterable[int]) -> dict[int, np.ndarray]:
        """Node -> ``(4, 4)`` its transform in the world at rest, for nodes and all above them."""
        matrices: dict[int, np.ndarray] = {}
        for node in nodes:
            waiting = []
            while node >= 0 and node not in matrices:
                waiting.append(node)
                node = self.parents[node]
            for each in reversed(waiting):
                local = transform(self.translation[each], self.rotation[each], self.scale[each])
                parent = self.parents[each]
                matrices[each] = matrices[parent] @ local if parent >= 0 else local
        return matrices

    @property
    def plain(self) -> np.ndarray:
        """``(nodes,)`` whether a node scales all directions alike, without mirroring."""
        low, high = self.scale.min(axis=1), self.scale.max(axis=1)
        return (low > 0) & (high - low <= UNIFORM * high)


def transform(translation: np.ndarray, turn: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """``(..., 4, 4)`` from ``(..., 3)``, ``(..., 4)`` and ``(..., 3)``: scale, then turn, then move."""
    turned = rotation.to_matrix(turn) * scale[..., None, :]
    matrix = np.zeros((*np.broadcast_shapes(turned.shape[:-2], translation.shape[:-1]), 4, 4))
    matrix[..., :3, :3] = turned
    matrix[..., :3, 3] = translation
    matrix[..., 3, 3] = 1.0
    return matrix


def decomposed(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Translation, turn and scale of a ``(4, 4)`` transform; shear is left out."""
    linear = matrix[:3, :3]
    scale = np.linalg.norm(linear, axis=0)
    if np.linalg.det(linear) < 0:
        scale = -scale
    return matrix[:3, 3], nearest_turn(linear / np.where(np.abs(scale) > 1e-30, scale, 1.0)), scale


def nearest_turn(matrices: np.ndarray) -> np.ndarray:
    """``(..., 4)`` the rotations nearest to linear maps ``(..., 3, 3)`` (Procrustes, Schönemann 1966)."""
    u, _, v = np.linalg.svd(matrices)
    u[..., :, 2] *= np.sign(np.linalg.det(u) * np.linalg.det(v))[..., None]
    nearest: np.ndarray = rotation.from_matrix(u @ v)
    return nearest


@dataclass(frozen=True, eq=False)
class Track:
    """The values of one property of one node over time (interpolation as in glTF 2.0, appendix C).

    path:   translation, rotation (w first) or scale.
    times:  ``(keys,)`` seconds, ascending.
    values: ``(keys, width)``; with CUBICSPLINE ``(keys, 3, width)``: in-tangent, value, out-tangent.
    """

    node: int
    path: str
    times: np.ndarray
    values: np.ndarray
    interpolation: str

    @property
    def keyed(self) -> np.ndarray:
        """``(keys, width)`` the values at the keys."""
        return self.values[:, 1] if self.interpolation == "CUBICSPLINE" else self.values

    def at(self, times: np.ndarray) -> np.ndarray:
        """``(frames, width)`` at times ``(frames,)``; beyond the keys the first and last value."""
        if self.interpolation != "CUBICSPLINE" and np.array_equal(times, self.times):
            return self._normalised(self.values)
        low = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 1)
        if self.interpolation == "STEP":
            return self._normalised(self.values[low])
        high = np.minimum(low + 1, len(self.times) - 1)
        span = self.times[high] - self.times[low]
        share = np.clip((times - self.times[low]) / np.where(span > 0, span, 1.0), 0.0, 1.0)
        if self.interpolation == "CUBICSPLINE":
            return self._normalised(self._spline(low, high, share[:, None], span[:, None]))
        if self.path == "rotation":
            values = self._normalised(self.values)
            return rotation.slerp(values[low], values[high], share)
        return self.values[low] + share[:, None] * (self.values[high] - self.values[low])

    def _spline(self, low: np.ndarray, high: np.ndarray, t: np.ndarray, span: np.ndarray) -> np.ndarray:
        """Appendix C.4: a cubic Hermite spline with tangents per second."""
        square, cube = t * t, t * t * t
        values: np.ndarray = (
            (2 * cube - 3 * square + 1) * self.values[low, 1]
            + span * (cube - 2 * square + t) * self.values[low, 2]
            + (3 * square - 2 * cube) * self.values[high, 1]
            + span * (cube - square) * self.values[high, 0]
        )
        return values

    def _normalised(self, values: np.ndarray) -> np.ndarray:
        return rotation.normalise(values) if self.path == "rotation" else values


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


def shares_of_one(weights: np.ndarray) -> np.ndarray:
    """``(vertices, joints)`` weights that sum to 1; vertices without any follow the first joint."""
    total = weights.sum(axis=1, keepdims=True)
    weights[total[:, 0] <= 0, 0] = 1.0
    return weights / np.where(total > 0, total, 1.0)


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
