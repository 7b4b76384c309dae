"""Motions of a character: by rotations (Motion) or by joint positions only (Positions)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import kinematics, rotation

if TYPE_CHECKING:
    from retarget_bench.motion.character import Character
    from retarget_bench.motion.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Motion:
    """What a character does, as rotations.

    rotations: ``(frames, joints, 4)`` local unit quaternions, w first.
    root:      ``(frames, 3)`` metres, the root joint's place in the world (Y up).
    fps:       frames per second.

    Raises SkeletonError when the shapes do not fit the character's skeleton or fps is not positive.
    """

    character: Character
    rotations: np.ndarray
    root: np.ndarray
    fps: float

    def __post_init__(self) -> None:
        rotations = np.asarray(self.rotations, dtype=np.float64)
        root = np.asarray(self.root, dtype=np.float64)
        object.__setattr__(self, "rotations", rotations)
        object.__setattr__(self, "root", root)
        joints = len(self.character.skeleton)
        if rotations.ndim != 3 or rotations.shape[1:] != (joints, 4):
            raise SkeletonError(
                f"{self.character.name} has {joints} joints: rotations must be "
                f"(frames, {joints}, 4), got {rotations.shape}"
            )
        if root.shape != (rotations.shape[0], 3):
            raise SkeletonError(
                f"{rotations.shape[0]} frames of rotations need a root of "
                f"({rotations.shape[0]}, 3), got {root.shape}"
            )
        _check_fps(self.fps)

    @property
    def skeleton(self) -> Skeleton:
        return self.character.skeleton

    @property
    def frames(self) -> int:
        return self.rotations.shape[0]

    @cached_property
    def _world(self) -> tuple[np.ndarray, np.ndarray]:
        return kinematics.forward(self.skeleton, self.rotations, self.root)

    @property
    def positions(self) -> np.ndarray:
        """``(frames, joints, 3)`` metres in the world; computed once."""
        return self._world[0]

    @property
    def global_rotations(self) -> np.ndarray:
        """``(frames, joints, 4)`` world orientations of the joints; computed once."""
        return self._world[1]

    def copy(self) -> Motion:
        """The same motion with arrays of its own."""
        return replace(self, rotations=np.array(self.rotations), root=np.array(self.root))

    def at(self, frames: slice | np.ndarray) -> Motion:
        """The chosen frames, at the same rate."""
        return replace(self, rotations=self.rotations[frames], root=self.root[frames])

    def resample(self, fps: float) -> Motion:
        """The same motion at another rate: slerp for rotations, linear for the root.

        An integer ratio keeps every n-th frame untouched; the first frame always stays.
        """
        if (frames := _whole_step(self.fps, fps)) is not None:
            return replace(self, rotations=self.rotations[::frames], root=self.root[::frames], fps=fps)
        low, share = _grid(self.frames, self.fps, fps)
        high = np.minimum(low + 1, self.frames - 1)
        turned = rotation.slerp(
            self.rotations[low],
            self.rotations[high],
            share[:, None],  # share: (frames', 1)
        )
        root = self.root[low] + share[:, None] * (self.root[high] - self.root[low])
        return Motion(self.character, turned, root, fps)


@dataclass(frozen=True, eq=False)
class Positions:
    """A motion known by joint positions only.

    positions: ``(frames, joints, 3)`` metres in the world (Y up), joints in skeleton order.
    """

    character: Character
    positions: np.ndarray
    fps: float

    def __post_init__(self) -> None:
        positions = np.asarray(self.positions, dtype=np.float64)
        object.__setattr__(self, "positions", positions)
        joints = len(self.character.skeleton)
        if positions.ndim != 3 or positions.shape[1:] != (joints, 3):
            raise SkeletonError(
                f"{self.character.name} has {joints} joints: positions must be "
                f"(frames, {joints}, 3), got {positions.shape}"
            )
        _check_fps(self.fps)

    @property
    def skeleton(self) -> Skeleton:
        return self.character.skeleton

    @property
    def frames(self) -> int:
        return self.positions.shape[0]

    @property
    def root(self) -> np.ndarray:
        """``(frames, 3)`` metres: the root joint."""
        return self.positions[:, 0]

    def copy(self) -> Positions:
        """The same motion with an array of its own."""
        return replace(self, positions=np.array(self.positions))

    def at(self, frames: slice | np.ndarray) -> Positions:
        """The chosen frames, at the same rate."""
        return replace(self, positions=self.positions[frames])

    def resample(self, fps: float) -> Positions:
        """The same motion at another rate, linear in every coordinate."""
        if (frames := _whole_step(self.fps, fps)) is not None:
            return replace(self, positions=self.positions[::frames], fps=fps)
        low, share = _grid(self.frames, self.fps, fps)
        high = np.minimum(low + 1, self.frames - 1)
        first, second = self.positions[low], self.positions[high]
        return replace(self, positions=first + share[:, None, None] * (second - first), fps=fps)


def resampled_frames(frames: int, fps: float, wanted: float) -> int:
    """How many frames ``resample`` makes of so many."""
    if step := _whole_step(fps, wanted):
        return len(range(0, frames, step))
    return len(_grid(frames, fps, wanted)[0]) if frames else 0


def _check_fps(fps: float) -> None:
    if not (np.isfinite(fps) and fps > 0):
        raise SkeletonError(f"frames per second must be positive, got {fps}")


def _whole_step(fps: float, wanted: float) -> int | None:
    """How many frames to step by when the rates differ by a whole factor, else None.

    Frame times in files are rounded (0.016667, .0083333), so 0.1 % counts as whole.
    """
    _check_fps(wanted)
    step = round(fps / wanted)
    return step if step >= 1 and abs(fps / wanted - step) < 1e-3 * step else None


def _grid(frames: int, fps: float, wanted: float) -> tuple[np.ndarray, np.ndarray]:
    """For every new frame: the old frame at or before it, and the share of the way to the next."""
    length = int(np.floor((frames - 1) * wanted / fps + 1e-6)) + 1
    at = np.arange(length) * (fps / wanted)
    low = np.minimum(np.floor(at + 1e-9).astype(int), frames - 1)
    return low, np.clip(at - low, 0.0, 1.0)


Prediction = Motion | Positions
"""What a method may answer with, and what a source may be."""
