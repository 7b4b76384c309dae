"""The bodies of a batch, and what a frame of the decoder's output means on them."""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from retarget_bench.motion.body22 import folded
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.kinematics_torch import forward as kinematics
from retarget_bench.training.layers.kinematic.pose import MOVES, UP, Scale, quaternions


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
