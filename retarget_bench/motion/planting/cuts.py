"""Cuts in a motion, over which nothing is eased or averaged."""

from itertools import pairwise

import numpy as np

from retarget_bench.motion.motion import Source

_JUMP, _SUDDEN = 0.1, 4.0
"""Body heights, and times: the steps of a cut. Recorded and generated motion have at most 0.05 heights with
a step that stands out as much, files with a rest pose before them at least 0.13."""


def takes(source: Source) -> list[slice]:
    """Stretches of frames between cuts, where the whole body is elsewhere or in another pose at once.

    Files often begin with a frame in the rest pose at the origin. At a cut, joints move by more than
    ``_JUMP`` heights on average and ``_SUDDEN`` times as far as in the steps before and after.
    """
    steps = np.linalg.norm(np.diff(source.positions, axis=0), axis=-1).mean(axis=1)
    beside = np.pad(steps, 1, constant_values=-1.0)
    calm = np.maximum(beside[:-2], beside[2:])
    jump = (steps > _JUMP * source.character.height) & (steps > _SUDDEN * calm) & (calm >= 0.0)
    edges = [0, *(np.flatnonzero(jump) + 1).tolist(), source.frames]
    return [slice(first, last) for first, last in pairwise(edges)]
