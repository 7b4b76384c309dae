"""Scanned motion: frames of unordered points on a body that nothing else is known of."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion.character import Character, Prediction
from retarget_bench.motion.skeleton import Skeleton

JOINT = "centre of the points"
"""The one joint of a body of which only points are seen; no skeleton has a joint of this name."""
POINTS = "points"
"""Structure of such bodies, and the kind of source in cards."""


def unknown_body(name: str) -> Character:
    """A character of one joint without a role: what is known of a body of which only points are seen."""
    skeleton = Skeleton((JOINT,), np.array([-1]), np.zeros((1, 3)))
    return Character.of(name, skeleton, structure=POINTS, roles=(None,))


@dataclass(frozen=True, eq=False)
class PointSets:
    """Points on the surface of a moving body, frame by frame, in no order and without correspondence.

    character: ``unknown_body(name)``.
    points:    for each frame ``(points, 3)`` metres in the world (Y up), single or double precision; their
               number may differ between frames.
    fps:       frames per second.

    Raises SkeletonError where the character has a skeleton, a frame has no points, points of another shape
    or not finite, or fps is not positive.
    """

    character: Character
    points: tuple[np.ndarray, ...]
    fps: float

    def __post_init__(self) -> None:
        name = self.character.name
        if not (np.isfinite(self.fps) and self.fps > 0):
            raise SkeletonError(f"frames per second must be positive, got {self.fps}")
        if len(self.skeleton) != 1:
            raise SkeletonError(f"{name}: points are of unknown_body(name), which has no skeleton")
        for frame, each in enumerate(self.points):
            if each.ndim != 2 or each.shape[1] != 3 or not len(each):
                raise SkeletonError(f"{name}, frame {frame}: points must be (points, 3), got {each.shape}")
            if not np.isfinite(each).all():
                raise SkeletonError(f"{name}, frame {frame}: points are not finite")

    @property
    def skeleton(self) -> Skeleton:
        """Of one joint: nothing is known of the body's own."""
        return self.character.skeleton

    @property
    def frames(self) -> int:
        return len(self.points)

    @cached_property
    def positions(self) -> np.ndarray:
        """``(frames, 1, 3)`` metres: the mean of each frame's points."""
        means = [each.mean(axis=0, dtype=np.float64) for each in self.points]
        return np.array(means).reshape(-1, 1, 3)

    @property
    def root(self) -> np.ndarray:
        """``(frames, 3)`` metres: the mean of each frame's points."""
        return self.positions[:, 0]

    @property
    def counts(self) -> np.ndarray:
        """``(frames,)`` points of each frame."""
        return np.array([len(each) for each in self.points], dtype=np.int64)

    def copy(self) -> Self:
        """The same points in arrays of their own."""
        return replace(self, points=tuple(each.copy() for each in self.points))

    def at(self, frames: slice | np.ndarray) -> Self:
        """The chosen frames, at the same rate."""
        chosen = np.arange(self.frames)[frames]
        return replace(self, points=tuple(self.points[k] for k in chosen))


Source = Prediction | PointSets
"""A source of retargeting."""


def kind_of(motion: Source) -> str:
    """The kind of a motion, in the word of cards: ``motion`` (rotations), ``positions``, ``surface``
    (vertices of the body's mesh) or ``points``."""
    return POINTS if isinstance(motion, PointSets) else motion.kind
