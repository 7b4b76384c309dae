"""PMnet's networks: an encoder of poses, two heads of quaternions, and convolutions of movements.

Time comes first: ``(frames, rows, ...)``. Source: Lim et al., BMVC 2019, and the published code.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import folded
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.kinematics_torch import forward as kinematics
from retarget_bench.training.layers.kinematic.pose import MOVES, UP, Scale, quaternions

DROP = 0.2
"""Share of hidden numbers that are dropped while training."""
REFERENCE = 16
"""Numbers that describe the target."""
WIDTH, KERNEL, LEAK = 128, 3, 0.2
"""Of the convolutions of movements."""


@dataclass(frozen=True, eq=False)
class Bodies:
    """The bodies of the rows of a batch, which share a tree.

    offsets: ``(rows, joints, 3)`` centimetres, bones of the reference pose. heights: ``(rows, 1)``
    centimetres, where the hips are in all frames. sizes: ``(rows, 1)`` heights along the bones, in hundreds
    of centimetres. lacks, lacking: see ``folded``.
    """

    tree: Tree
    offsets: Tensor
    heights: Tensor
    sizes: Tensor
    lacks: Tensor | None = None
    lacking: Sequence[int] | None = None

    @property
    def rest(self) -> Tensor:
        """``(rows, 3 joints)`` centimetres: the bones, and where the hips are."""
        flat = self.offsets.flatten(1)
        return torch.cat([flat[:, :UP], self.heights, flat[:, UP + 1 :]], 1)

    def places(self, rotations: Tensor) -> Tensor:
        """``(frames, rows, 3 joints)`` centimetres, from unit quaternions ``(frames, rows, joints, 4)``."""
        if self.lacks is not None:
            rotations = folded(rotations, self.lacks, self.lacking)
        frames, rows = rotations.shape[:2]
        root = self.rest[:, None, :3].expand(rows, frames, 3)
        positions, _ = kinematics(self.tree, self.offsets, rotations.transpose(0, 1), root)
        return positions.transpose(0, 1).flatten(2)


class Generator(nn.Module):
    """The networks of one structure, and the scale of its numbers."""

    def __init__(self, joints: int, hidden: int = 512) -> None:
        super().__init__()
        self.scale = Scale(joints)
        self.encoder = nn.ModuleList(
            nn.Linear(inputs, hidden) for inputs in (3 * joints, hidden, hidden, hidden)
        )
        self.turns = nn.Linear(hidden, 4 * joints)
        self.reference = nn.Linear(3 * joints, REFERENCE)
        self.mapping = nn.Linear(hidden + REFERENCE, 4 * joints)
        self.movement = nn.ModuleList(
            nn.Conv1d(a, b, KERNEL, padding=KERNEL // 2) for a, b in ((MOVES, WIDTH), (WIDTH, MOVES))
        )
        for layer in (*self.encoder, self.reference, *self.movement):
            nn.init.xavier_uniform_(layer.weight)
            nn.init.zeros_(layer.bias)
        for layer in (self.turns, self.mapping):
            nn.init.normal_(layer.weight, std=0.002)
            nn.init.zeros_(layer.bias)
            layer.bias.data[::4] = 1.0

    def encode(self, places: Tensor) -> Tensor:
        """Features ``(frames, rows, hidden)`` of normalised places ``(frames, rows, 3 joints)``."""
        hidden = places
        for number, layer in enumerate(self.encoder):
            hidden = functional.relu(layer(hidden))
            if number < len(self.encoder) - 1:
                hidden = functional.dropout(hidden, DROP, self.training)
        return hidden

    def solved(self, features: Tensor) -> Tensor:
        """Rotations ``(frames, rows, joints, 4)`` of the very pose that features are of."""
        return quaternions(self.turns(features))

    def answer(self, features: Tensor, bodies: Bodies) -> Tensor:
        """Rotations ``(frames, rows, joints, 4)`` of the pose on other bodies: those of the pose itself,
        each followed by one that depends on the body."""
        reference = torch.sigmoid(self.reference(self.scale.normalise("places", bodies.rest)))
        reference = reference.expand(len(features), -1, -1)  # every frame has a mask of its own
        reference = functional.dropout(reference, DROP, self.training)
        change = quaternions(self.mapping(torch.cat([features, reference], -1)))
        return rotation.multiply(self.solved(features), change)

    def moved(self, moves: Tensor, real: Tensor) -> Tensor:
        """Movements ``(frames, rows, 4)`` on the target, from those of the source; both are ``divided``.

        real: ``(frames, rows)``: 1 at real frames, 0 behind, where nothing moves.
        """
        first, second = self.movement
        shown = real.T.unsqueeze(1)
        hidden = functional.leaky_relu(first(moves.permute(1, 2, 0) * shown), LEAK) * shown
        return (second(hidden) * shown).permute(2, 0, 1)


def divided(moves: Tensor, sizes: Tensor) -> Tensor:
    """Movements ``(frames, rows, 4)`` whose lengths are divided by sizes ``(rows, 1)``; turns stay."""
    return torch.cat([moves[..., : MOVES - 1] / sizes, moves[..., MOVES - 1 :]], -1)
