"""A tree of joints with the bone vectors of its rest pose."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from retarget_bench.errors import SkeletonError


@dataclass(frozen=True)
class EndSite:
    """The tip of a last bone. Kept for round trips and heights; it is not a joint.

    ``parent`` is a joint index, ``offset`` the tip's place in that joint's frame (metres).
    """

    parent: int
    offset: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Joint names, parents and rest offsets. Immutable.

    names:     one per joint, unique, not empty.
    parents:   ``(joints,)`` integers, -1 for the root alone, every parent before its children.
    offsets:   ``(joints, 3)`` metres, each joint in its parent's frame at zero rotation.
               Row 0 is the root's place in the rest pose as the file states it; it never enters
               the kinematics, where a motion gives the root's place.
    end_sites: tips of the last bones.

    Raises SkeletonError when these do not form one tree or are not finite.
    """

    names: tuple[str, ...]
    parents: np.ndarray
    offsets: np.ndarray
    end_sites: tuple[EndSite, ...] = ()

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "names", tuple(self.names))
        set_(self, "parents", frozen(self.parents, np.int64))
        set_(self, "offsets", frozen(self.offsets, np.float64))
        set_(self, "end_sites", tuple(self.end_sites))
        n = len(self.names)
        if n == 0:
            raise SkeletonError("a skeleton needs at least one joint")
        if self.parents.shape != (n,) or self.offsets.shape != (n, 3):
            raise SkeletonError(
                f"{n} joint names need parents ({n},) and offsets ({n}, 3); "
                f"got {self.parents.shape} and {self.offsets.shape}"
            )
        if any(not name for name in self.names):
            raise SkeletonError(f"joint {self.names.index('')} has no name")
        if len(set(self.names)) != n:
            twice = next(name for i, name in enumerate(self.names) if name in self.names[:i])
            raise SkeletonError(f"two joints are called {twice!r}")
        if self.parents[0] != -1:
            raise SkeletonError("joint 0 must be the root, with parent -1")
        for joint in range(1, n):
            if not 0 <= self.parents[joint] < joint:
                raise SkeletonError(
                    f"joint {self.names[joint]!r} has parent {self.parents[joint]}: "
                    "parents must come before their children, and only joint 0 may be a root"
                )
        tips = np.array([site.offset for site in self.end_sites], dtype=float)
        if not (np.isfinite(self.offsets).all() and np.isfinite(tips).all()):
            raise SkeletonError("an offset is not finite")
        if any(not 0 <= site.parent < n for site in self.end_sites):
            raise SkeletonError("an end site has no such parent joint")

    def __len__(self) -> int:
        return len(self.names)

    def scaled(self, by: float) -> Skeleton:
        """The same skeleton, so many times as large."""
        sites = tuple(
            EndSite(site.parent, (site.offset[0] * by, site.offset[1] * by, site.offset[2] * by))
            for site in self.end_sites
        )
        return replace(self, offsets=self.offsets * by, end_sites=sites)

    def index(self, name: str) -> int:
        """The joint called ``name``; raises SkeletonError with the known names otherwise."""
        try:
            return self._index[name]
        except KeyError:
            raise SkeletonError(f"no joint {name!r}; joints are {', '.join(self.names)}") from None

    @cached_property
    def _index(self) -> dict[str, int]:
        return {name: joint for joint, name in enumerate(self.names)}

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """The children of every joint, in joint order."""
        below: list[list[int]] = [[] for _ in self.names]
        for joint, parent in enumerate(self.parents.tolist()):
            if parent >= 0:
                below[parent].append(joint)
        return tuple(tuple(each) for each in below)

    @cached_property
    def bone_lengths(self) -> np.ndarray:
        """``(joints,)`` metres; 0 for the root, which has no bone."""
        lengths = np.linalg.norm(self.offsets, axis=1)
        lengths[0] = 0.0
        return frozen(lengths, np.float64)

    @cached_property
    def rest_positions(self) -> np.ndarray:
        """``(joints, 3)`` metres: joints at zero rotation, the root at its rest offset."""
        places = np.array(self.offsets)
        for joint, parent in enumerate(self.parents.tolist()):
            if parent >= 0:
                places[joint] += places[parent]
        return frozen(places, np.float64)

    @cached_property
    def topology_id(self) -> str:
        """A short hash of names and parents: equal for skeletons that differ in offsets only."""
        text = "\n".join(f"{n} {p}" for n, p in zip(self.names, self.parents.tolist(), strict=True))
        return "t" + hashlib.sha256(text.encode()).hexdigest()[:8]

    def same_as(self, other: Skeleton, tolerance: float = 1e-6) -> bool:
        """Equal names, parents and, within ``tolerance`` metres, bone offsets."""
        return self is other or (
            self.names == other.names
            and np.array_equal(self.parents, other.parents)
            and bool(np.abs(self.offsets[1:] - other.offsets[1:]).max(initial=0.0) <= tolerance)
        )


def frozen(array: np.ndarray, dtype: type) -> np.ndarray:
    """A read-only contiguous copy."""
    copy: np.ndarray = np.array(array, dtype=dtype, order="C")
    copy.setflags(write=False)
    return copy
