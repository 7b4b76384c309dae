"""SMRM's networks: two recurrent ones and forward kinematics, as Table 6 of the paper lists them."""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.motion.body22 import JOINTS, SKELETON, folded
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.kinematics_torch import forward as kinematics
from retarget_bench.training.layers.normaliser import Normaliser

MOVES = 3


class Answer(NamedTuple):
    """For ``(rows, frames)``. positions: ``(22, 3)`` units, relative to the hips. rotations: ``(22, 4)``,
    unit, in aligned form. moves: ``(3,)``, see ``Features.moves``."""

    positions: Tensor
    rotations: Tensor
    moves: Tensor


class Generator(nn.Module):
    """Encoder and decoder: two-layer GRUs, each going through time once; the answer is not fed back.

    With 512 hidden numbers it has 5,771,355 parameters. The dropout is torch's: between the two layers.
    """

    def __init__(self, hidden: int = 512, dropout: float = 0.2) -> None:
        super().__init__()
        self.scale = Normaliser(positions=3 * JOINTS, moves=MOVES, resting=3 * JOINTS)
        self.encoder = nn.GRU(3 * JOINTS + MOVES, hidden, 2, batch_first=True, dropout=dropout)
        self.decoder = nn.GRU(3 * JOINTS + hidden, hidden, 2, batch_first=True, dropout=dropout)
        self.turns = nn.Linear(hidden, 4 * JOINTS)
        self.moves = nn.Linear(hidden, MOVES)
        with torch.no_grad():
            self.turns.bias.copy_(torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(JOINTS))
        self.tree = Tree.of(SKELETON)

    def encode(
        self, positions: Tensor, moves: Tensor, state: Tensor | None = None
    ) -> tuple[Tensor, Tensor]:
        """Codes ``(rows, frames, hidden)`` and the encoder's state after them.

        positions: ``(rows, frames, 22, 3)`` and moves: ``(rows, frames, 3)`` of the source, in its units.
        """
        places = self.scale.normalise("positions", positions.flatten(-2))
        inputs = torch.cat([places, self.scale.normalise("moves", moves)], -1)
        codes, after = self.encoder(inputs, state)
        return codes, after

    def decode(
        self,
        codes: Tensor,
        offsets: Tensor,
        resting: Tensor,
        state: Tensor | None = None,
        lacks: Tensor | None = None,
        lacking: Sequence[int] | None = None,
    ) -> tuple[Answer, Tensor]:
        """The answer in the target's units, and the decoder's state after it.

        offsets, resting: ``(rows, 22, 3)`` of the target, see ``SmrmBody``.
        lacks: ``(rows, 22)`` bool, its joints of no length (``motion/body22.py``), which do not turn.
        lacking: their ranks, where they are known; see ``folded``.
        """
        rotations, moves, after = self.decode_rotations(codes, resting, state, lacks, lacking)
        tree = self._tree(rotations.device)
        positions, _ = kinematics(tree, offsets, rotations, torch.zeros_like(moves))
        return Answer(positions, rotations, moves), after

    def decode_rotations(
        self,
        codes: Tensor,
        resting: Tensor,
        state: Tensor | None = None,
        lacks: Tensor | None = None,
        lacking: Sequence[int] | None = None,
    ) -> tuple[Tensor, Tensor, Tensor]:
        """``decode`` without positions: rotations ``(rows, frames, 22, 4)``, moves ``(rows, frames, 3)``,
        and the decoder's state after them."""
        body = self.scale.normalise("resting", resting.flatten(-2)).unsqueeze(1)
        hidden, after = self.decoder(torch.cat([body.expand(-1, codes.shape[1], -1), codes], -1), state)
        rotations = functional.normalize(self.turns(hidden).float().unflatten(-1, (JOINTS, 4)), dim=-1)
        if lacks is not None:
            rotations = folded(rotations, lacks.unsqueeze(1), lacking)
        return rotations, self.scale.restore("moves", self.moves(hidden).float()), after

    def _tree(self, device: torch.device) -> Tree:
        if self.tree.mask.device != device:
            self.tree = self.tree.to(device)
        return self.tree
