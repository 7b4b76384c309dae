"""Stochastic joint subsampling (section 3.4.2, A.4): parts of a skeleton as skeletons of their own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

DROP_MAJOR, DROP_OTHER = 0.1, 0.5
FEWEST = 2


def kept(numbers: np.random.Generator, major: np.ndarray) -> np.ndarray:
    """Indices of the joints that stay, increasing; drawn again where fewer than two do.

    major: ``(joints,)`` bool.
    """
    drop = np.where(major, DROP_MAJOR, DROP_OTHER)
    while True:
        found = np.flatnonzero(numbers.random(len(major)) >= drop)
        if len(found) >= min(FEWEST, len(major)):
            return found


def parents_among(parents: Sequence[int], joints: np.ndarray) -> np.ndarray:
    """``(kept,)`` each joint's nearest ancestor among those kept, by its place there; -1 where none is."""
    place = {int(joint): number for number, joint in enumerate(joints)}
    found = []
    for joint in joints.tolist():
        above = parents[joint]
        while above >= 0 and above not in place:
            above = parents[above]
        found.append(place.get(above, -1))
    return np.array(found, dtype=np.int64)
