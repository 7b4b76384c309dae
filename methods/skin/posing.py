"""Transforms of points that follow the 22 joints, by forward kinematics."""

import numpy as np

from retarget_bench.motion.body22 import PARENTS


def transforms_of(joints: np.ndarray, matrices: np.ndarray, hips: np.ndarray) -> np.ndarray:
    """``(frames, 22, 3)`` metres: what is added to a point after joint j has turned it by its matrix.

    joints: ``(22, 3)`` in T-pose. matrices: ``(frames, 22, 3, 3)`` world rotations since then. hips:
    ``(frames, 3)`` this shift of the hips; the other joints follow by forward kinematics.
    """
    shifts = np.empty((len(matrices), len(joints), 3))
    shifts[:, 0] = hips
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            # the joint itself goes where its parent takes it
            change = matrices[:, parent] - matrices[:, joint]
            shifts[:, joint] = shifts[:, parent] + change @ joints[joint]
    return shifts
