"""Linear blend skinning over the 22 joints in NumPy."""

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


def posed(points: np.ndarray, shares: np.ndarray, matrices: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """``(frames, V, 3)`` metres: points ``(V, 3)`` moved by their shares ``(V, 22)`` of the joints.

    matrices: ``(frames, 22, 3, 3)`` and shifts: ``(frames, 22, 3)``, see ``transforms_of``. One product of
    matrices moves all points in all frames: skinning is linear in the transforms.
    """
    around = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    spread = (shares[:, :, None] * around[:, None, :]).reshape(len(points), -1)  # (V, 22 * 4)
    moves = np.concatenate([matrices, shifts[..., None]], axis=-1)  # (frames, 22, 3, 4)
    columns = moves.transpose(0, 2, 1, 3).reshape(-1, spread.shape[1])
    found: np.ndarray = (columns @ spread.T).reshape(len(moves), 3, -1).swapaxes(1, 2)
    return found
