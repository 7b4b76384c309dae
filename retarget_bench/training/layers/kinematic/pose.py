"""A frame's numbers: normalised joint positions and movement, and the quaternions of an answer.

A pose is ``channels = 3 joints + 4`` numbers: the places of the joints relative to the hips in centimetres,
seen from where the body faces, with the height of the hips above their first place in the row of the hips,
then left, up, forward (centimetres per frame) and turn (radians per frame); see ``features.py``, also for
centimetres that grow with the body. In the ``released`` variant all places are raised by the height of the
hips above the floor in the first frame of their clip instead, which is also what the row of the hips holds.
"""

import torch
from torch import Tensor
from torch.nn import functional

from retarget_bench.training.layers.normaliser import Normaliser

MOVES = 4
"""Numbers of a frame that are no joint's: left, up, forward and turn."""
UP = 1
"""Which of the movements, and of the coordinates of a place, is the vertical one."""


class Scale(Normaliser):
    """Means and deviations of positions (and bones) and of movements, from the training clips."""

    places_mean: Tensor
    places_deviation: Tensor
    moves_mean: Tensor
    moves_deviation: Tensor

    def __init__(self, joints: int) -> None:
        super().__init__(places=3 * joints, moves=MOVES)

    def poses(self, plain: Tensor) -> Tensor:
        """``(..., channels)`` normalised."""
        return (plain - self._both("mean")) / self._both("deviation")

    def plain(self, poses: Tensor) -> Tensor:
        """``(..., channels)`` in centimetres and radians: the inverse of ``poses``."""
        return poses * self._both("deviation") + self._both("mean")

    def bones(self, offsets: Tensor) -> Tensor:
        """``(..., 3 (joints - 1))`` from offsets ``(..., joints, 3)`` centimetres; the hips have none."""
        return self.normalise("places", offsets.flatten(-2))[..., 3:]

    def _both(self, statistic: str) -> Tensor:
        return torch.cat([self.get_buffer(f"{kind}_{statistic}") for kind in ("places", "moves")])


def quaternions(turns: Tensor) -> Tensor:
    """``(..., joints, 4)`` of unit length, from ``(..., 4 joints)``."""
    return functional.normalize(turns.reshape(*turns.shape[:-1], -1, 4), dim=-1)
