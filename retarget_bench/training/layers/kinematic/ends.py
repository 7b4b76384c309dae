"""Ends of limbs, by which answers on bodies of another structure can be told from the source."""

from collections.abc import Mapping, Sequence

import numpy as np
from torch import Tensor

from retarget_bench.training.layers.kinematic.pose import MOVES


class Ends:
    """Joints by roles that two bodies have, and the lengths of the chains from the hips to them.

    reaches: character -> role -> (joint, length of its chain in the body's unit).
    """

    def __init__(self, weight: float, reaches: Mapping[str, Mapping[str, tuple[int, float]]]) -> None:
        self.weight, self._reaches = weight, reaches

    def shares(self, cast: Sequence[str], names: Sequence[str]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Joints ``(n,)`` and chain lengths ``(rows, n, 1)`` of both bodies of every row."""
        bodies = [self._reaches[name] for name in (*cast, *names)]
        roles = [role for role in bodies[0] if all(role in body for body in bodies)]
        shares = []
        for group in (bodies[: len(cast)], bodies[len(cast) :]):
            joints = np.array([group[0][role][0] for role in roles])
            lengths = np.array([[body[role][1] for role in roles] for body in group], dtype=np.float32)
            shares.append((joints, lengths[..., None]))
        return shares

    def scaled(self, poses: Tensor, shared: Sequence[tuple[Tensor, Tensor]], which: int) -> Tensor:
        """``(frames, rows, n, 3)`` joints of plain poses ``(frames, rows, channels)``, in chain lengths."""
        joints, lengths = shared[which]
        places = poses[..., :-MOVES].reshape(*poses.shape[:2], -1, 3)
        return places[:, :, joints] / lengths


def ends_loss(a: Tensor, b: Tensor, real: Tensor) -> Tensor:
    """The sum over real frames and joints of squared differences of places ``(frames, rows, joints, 3)``,
    in lengths of the chains that lead to them. Not in the paper."""
    return ((a - b).square().sum((-1, -2)) * real).sum()
