"""Cuts in a motion, over which nothing is eased or averaged."""

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.motion import Source

_JUMP, _SUDDEN = 0.1, 4.0
"""Body heights, and times: the steps of a cut. Recorded and generated motion have at most 0.05 heights with
a step that stands out as much, files with a rest pose before them at least 0.13."""


def takes(source: Source) -> list[slice]:
    """Stretches of frames between cuts, where the whole body is elsewhere or in another pose at once.

    Files often begin with a frame in the rest pose at the origin. At a cut, joints move by more than
    ``_JUMP`` heights on average and ``_SUDDEN`` times as far as in the steps before and after.
    """
    places = source.positions
    steps = rotation.in_blocks(_step, places[:-1], places[1:])
    beside = np.pad(steps, 1, constant_values=-1.0)
    calm = np.maximum(beside[:-2], beside[2:])
    jump = (steps > _JUMP * source.character.height) & (steps > _SUDDEN * calm) & (calm >= 0.0)
    edges = [0, *(np.flatnonzero(jump) + 1).tolist(), source.frames]
    return [slice(first, last) for first, last in pairwise(edges)]


def _step(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """``(frames,)`` metres that joints move on average from places ``(frames, joints, 3)`` to others."""
    return np.asarray(np.linalg.norm(after - before, axis=-1).mean(axis=1))


def joined(pieces: Iterable[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Rotations ``(frames, joints, 4)``, unit and continuous in sign, and root ``(frames, 3)`` of the takes
    of a motion, one after the other."""
    parts = [(rotation.normalise(turned), root) for turned, root in pieces]
    turned, root = (
        parts[0] if len(parts) == 1 else (np.concatenate(each) for each in zip(*parts, strict=True))
    )
    return rotation.continuous(turned), root
