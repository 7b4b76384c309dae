"""A body: its joints in the T-pose, and how its author drew its rest pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .proportions import Proportions
from .structures import Structure


@dataclass(frozen=True, eq=False)
class Body:
    """A performer, in the T-pose: Y up, facing +Z, left arm along +X, soles on the floor.

    offsets: ``(parts, 3)`` metres, from parent to joint, along world axes; row 0 is the root's place.
    part:    name of a part (``left_forearm``) -> joint. Parts are this package's own words; joint names
             are the structure's. The rig has the first ``structure.joints`` of them.
    rest:    how the rest pose is drawn (``rigs.py``).
    held_out: never in a training set.
    """

    name: str
    structure: Structure
    proportions: Proportions
    rest: str
    held_out: bool = False

    @cached_property
    def part(self) -> Mapping[str, int]:
        return {part: joint for joint, part in enumerate(self.structure.parts)}

    @cached_property
    def children(self) -> Mapping[str, list[tuple[int, str, bool]]]:
        """Part -> joint and part of each of its children, and whether that is silent."""
        structure = self.structure
        found: dict[str, list[tuple[int, str, bool]]] = {part: [] for part in structure.parts}
        for child, (part, parent) in enumerate(zip(structure.parts, structure.parents, strict=True)):
            if parent >= 0:
                found[structure.parts[parent]].append((child, part, part in structure.silent))
        return found

    @cached_property
    def offsets(self) -> np.ndarray:
        structure, places = self.structure, self.structure.places(self.proportions)
        return np.array(
            [
                places[part] - (places[structure.parts[parent]] if parent >= 0 else 0.0)
                for part, parent in zip(structure.parts, structure.parents, strict=True)
            ]
        )

    @cached_property
    def tips(self) -> Mapping[str, np.ndarray]:
        """Part -> where its last bone ends, from its joint, for joints without children."""
        return self.structure.tips(self.proportions)

    def offset(self, part: str) -> np.ndarray:
        return self.offsets[self.part[part]]

    def reach(self, part: str, ancestor: str) -> np.ndarray:
        """``(3,)`` from an ancestor's joint to a part's joint in the T-pose."""
        total, joint = np.zeros(3), self.part[part]
        while joint != self.part[ancestor]:
            total = total + self.offsets[joint]
            joint = self.structure.parents[joint]
        return total

    def place(self, turned: np.ndarray, root: np.ndarray) -> np.ndarray:
        """Places ``(frames, parts, 3)`` from world orientations ``(frames, parts, 3, 3)``
        against the T-pose and the root's places ``(frames, 3)``."""
        places = np.empty((*turned.shape[:2], 3))
        places[:, 0] = root
        for joint, parent in enumerate(self.structure.parents):
            if parent >= 0:
                places[:, joint] = places[:, parent] + turned[:, parent] @ self.offsets[joint]
        return places
