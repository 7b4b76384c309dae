"""One performance by one body: inverse kinematics in closed form, over all frames at once.

What a performer does is passed over a fixed number of times, each time corrected by what the last pose
lacked; nothing stops early, and no choice is made between near equals, so results do not depend on a
machine's last digits.
"""

from dataclasses import dataclass

import numpy as np

from ..bodies.structures import Body
from ..performances.score import DogScore, Score
from .dogs import Dog, DogManner
from .people import Manner, Person


@dataclass(frozen=True, eq=False)
class Solution:
    """orientations: ``(frames, parts, 3, 3)`` in the world, against the T-pose. root: ``(frames, 3)``.
    planted: ``(frames, contacts)`` bool: left ankle, left toe joint, right ankle, right toe joint; of dogs,
    the paws. pivoting: likewise, which of them rotate about a resting point of the foot."""

    orientations: np.ndarray
    root: np.ndarray
    planted: np.ndarray
    pivoting: np.ndarray


def solve(score: Score, body: Body, manner: Manner | DogManner | None = None) -> Solution:
    """The performance of ``score`` by ``body``, in the usual manner or another one of its kind."""
    performer: Person | Dog
    if isinstance(score, DogScore):
        assert not isinstance(manner, Manner)
        performer = Dog(score, body, manner or DogManner())
    else:
        assert not isinstance(manner, DogManner)
        performer = Person(score, body, manner or Manner())
    pose = performer.pose()
    for _ in range(performer.passes - 1):
        performer.adjust(pose)
        pose = performer.pose()
    orientations = np.ascontiguousarray(pose.orientations.swapaxes(0, 1))
    planted = np.column_stack([path.planted for path in performer.paths.values()])
    pivoting = np.column_stack([path.pivoting for path in performer.paths.values()])
    return Solution(orientations, pose.positions[0], planted, pivoting)
