"""Decoding a frame's numbers: normalised joint positions and movement, and forward kinematics.

A pose is ``channels = 3 joints + 4`` numbers: the places of the joints relative to the hips in centimetres,
seen from where the body faces, with the height of the hips above their first place in the row of the hips,
then left, up, forward (centimetres per frame) and turn (radians per frame); see ``features.py``, also for
centimetres that grow with the body. In the ``released`` variant all places are raised by the height of the
hips above the floor in the first frame of their clip instead, which is also what the row of the hips holds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional

from retarget_bench.motion.body22 import folded
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.kinematics_torch import forward as kinematics
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


@dataclass(frozen=True, eq=False)
class Bodies:
    """The bodies of the rows of a batch, which share a tree.

    offsets: ``(rows, joints, 3)`` centimetres, the bones of the reference pose.
    lacks: ``(rows, 22)`` bool, joints of no length (``motion/body22.py``); None: none.
    lacking: ranks of those, where they are known; see ``folded``.
    heights: ``(rows, 1)`` of the hips, the same in all frames and added to all places, as in the authors'
             code; None: the hips rise with the movements, and the other joints are relative to them.
    """

    tree: Tree
    offsets: Tensor
    scale: Scale
    lacks: Tensor | None = None
    lacking: Sequence[int] | None = None
    heights: Tensor | None = None

    @property
    def bones(self) -> Tensor:
        """``(rows, 3 (joints - 1))`` normalised."""
        return self.scale.bones(self.offsets)

    def express(self, raw: Tensor, rise: Tensor, first: bool) -> tuple[Tensor, Tensor]:
        """The pose ``(rows, channels)`` that a decoder's output ``(rows, 4 joints + 4)`` means.

        rise:  ``(rows, 1)`` centimetres, how far the hips were above their first place; how far they are
               now is returned too. first: nothing came before, so the hips are where they begin.
        """
        rows, joints, _ = self.offsets.shape
        turns, moves = raw[:, :-MOVES], raw[:, -MOVES:]
        rotations = quaternions(turns.unsqueeze(1))
        if self.lacks is not None:
            rotations = folded(rotations, self.lacks.unsqueeze(1), self.lacking)
        up, root = slice(UP, UP + 1), raw.new_zeros(rows, 1, 3)
        if self.heights is not None:
            root[:, 0, up] = self.heights
        places, _ = kinematics(self.tree, self.offsets, rotations, root)
        flat = places.reshape(rows, 3 * joints)
        if self.heights is None:
            if not first:
                rise = rise + moves[:, up] * self.scale.moves_deviation[up] + self.scale.moves_mean[up]
            flat = torch.cat([flat[:, :1], rise, flat[:, 2:]], 1)
        return torch.cat([self.scale.normalise("places", flat), moves], 1), rise


def quaternions(turns: Tensor) -> Tensor:
    """``(..., joints, 4)`` of unit length, from ``(..., 4 joints)``."""
    return functional.normalize(turns.reshape(*turns.shape[:-1], -1, 4), dim=-1)
