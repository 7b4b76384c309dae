"""One performance by one body: inverse kinematics in closed form, over all frames at once.

What a performer does is passed over a fixed number of times, each time corrected by what the last pose
lacked; nothing stops early, and no choice is made between near equals, so results do not depend on a
machine's last digits.
"""

from dataclasses import dataclass

import numpy as np

from ...contract import USUAL, Manner
from ..bodies.structures import Body
from ..performances.score import DogScore, Score
from . import dogs, people
from .dogs import Dog
from .people import Person


@dataclass(frozen=True, eq=False)
class Solution:
    """orientations: ``(frames, parts, 3, 3)`` in the world, against the T-pose. root: ``(frames, 3)``.
    planted: ``(frames, contacts)`` bool: left ankle, left toe joint, right ankle, right toe joint; of dogs,
    the paws. pivoting: likewise, which of them rotate about a resting point of the foot."""

    orientations: np.ndarray
    root: np.ndarray
    planted: np.ndarray
    pivoting: np.ndarray


def solve(score: Score, body: Body, manner: Manner = USUAL) -> Solution:
    """The performance of ``score`` by ``body``."""
    performer: Person | Dog
    if isinstance(score, DogScore):
        performer = Dog(score, body, dogs.MANNERS[manner])
    else:
        performer = Person(score, body, people.MANNERS[manner])
    pose = performer.pose()
    for _ in range(performer.passes - 1):
        performer.adjust(pose)
        pose = performer.pose()
    orientations = np.ascontiguousarray(pose.orientations.swapaxes(0, 1))
    planted = np.column_stack([path.planted for path in performer.paths.values()])
    pivoting = np.column_stack([path.pivoting for path in performer.paths.values()])
    return Solution(orientations, pose.positions[0], planted, pivoting)
