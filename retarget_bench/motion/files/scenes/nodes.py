"""The tree of nodes of a file: their parents, and where every node is at rest."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

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
