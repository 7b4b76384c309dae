"""The edges of a structure that networks see, and the groups of edges that they pool.

An edge is an edge of the tree, from a joint to one that hangs from it, and carries the rotation of the
joint that it leaves; several edges that leave one joint each carry that joint's. The edge of the child c
is c - 1. One edge more, the last, is that of the root's movement; it belongs to every part.

Where the layout is one of joints, joints take the place of edges, and each carries its own rotation: so do
ends of chains. The hips then belong to every part as the root's movement does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

Slots = Literal["edges", "joints"]


@dataclass(frozen=True)
class Layout:
    """A structure as edges (or joints) and parts, which are body parts (PAN) or chains (SAN).

    parents: ``(joints,)`` whose child each joint is, the root (-1) first. roles: of the joints.
    names:   the parts that this structure has. parts: the edges of each, without those of every part.
    slots:   whether the networks see edges or joints; what is said of edges here holds for either.
    """

    parents: tuple[int, ...]
    roles: tuple[str | None, ...]
    names: tuple[str, ...]
    parts: tuple[tuple[int, ...], ...]
    slots: Slots = "edges"
    four_legged: bool = False

    @property
    def edges(self) -> int:
        """Without the root's movement."""
        return len(self.leads)

    @cached_property
    def common(self) -> tuple[int, ...]:
        """The edges of every part: the root's movement, last; of joints the hips as well."""
        return (self.edges,) if self.slots == "edges" else (0, self.edges)

    @cached_property
    def leads(self) -> np.ndarray:
        """``(edges,)`` the joint that each edge leads to."""
        return np.arange(1 if self.slots == "edges" else 0, len(self.parents))

    @cached_property
    def turned(self) -> np.ndarray:
        """``(edges,)`` which joint's rotation each edge carries."""
        return np.array(self.parents)[self.leads] if self.slots == "edges" else self.leads

    @cached_property
    def above(self) -> np.ndarray:
        """``(edges,)`` the edge that leads to the joint that each edge leaves; -1 at the root.

        Not of layouts of joints."""
        return self.turned - 1

    @cached_property
    def ends(self) -> np.ndarray:
        """The edges from whose child no edge leaves. Not of layouts of joints."""
        return np.setdiff1d(np.arange(self.edges), self.above)

    @cached_property
    def encoded(self) -> np.ndarray:
        """``(joints,)`` bool: the root, and joints that an edge of a part leads to."""
        mask = np.zeros(len(self.parents), dtype=bool)
        mask[[0, *self.leads[[edge for part in self.parts for edge in part]]]] = True
        return mask


def shared(source: Layout, target: Layout) -> list[int]:
    """The parts of the target that the source has too, by their numbers."""
    return [number for number, name in enumerate(target.names) if name in source.names]
