"""R2ET's skeleton-aware network: attention among the joints of a frame, and among the bones of both bodies.

Source: Zhang et al., CVPR 2023, section 3.2, with the sizes of the published code.
"""

from math import log, sqrt

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import JOINTS
from retarget_bench.training.layers.normaliser import Normaliser

TOKEN, MOTION, BODY = 64, 256, 128
"""Widths of a token, of a joint's code in a frame, and of its code in a body."""


class JointEncoder(nn.Module):
    """One code per joint, by attention among all joints.

    size: numbers that are known of a joint. width: of its code. The published code divides products of
    queries and keys by the square root of the whole token's width, not of a head's, and has no residual
    around attention, since widths differ.
    """

    def __init__(self, size: int, width: int, heads: int, dropout: float) -> None:
        super().__init__()
        self.heads = heads
        self.enter = nn.Linear(size, TOKEN)
        self.qkv = nn.Linear(TOKEN, 3 * TOKEN)
        self.out = nn.Linear(TOKEN, width)
        self.norm = nn.LayerNorm(width)
        self.feed = nn.ModuleList([nn.Linear(width, 2 * width), nn.Linear(2 * width, width)])
        self.dropout = nn.Dropout(dropout)
        for layer in (self.qkv, self.out, *self.feed):
            nn.init.xavier_uniform_(layer.weight)
            nn.init.zeros_(layer.bias)

    def forward(self, joints: Tensor) -> Tensor:
        """``(..., 22, width)`` from ``(..., 22, size)``."""
        tokens = self.enter(joints.flatten(0, -3))
        queries, keys, values = (
            each.unflatten(-1, (self.heads, -1)).transpose(1, 2) for each in self.qkv(tokens).chunk(3, -1)
        )
        attended = functional.scaled_dot_product_attention(queries, keys, values, scale=TOKEN**-0.5)
        code = self.dropout(self.out(attended.transpose(1, 2).flatten(2)))
        first, second = self.feed
        fed = self.dropout(functional.relu(first(self.norm(code))))
        return (code + self.dropout(second(fed))).unflatten(0, joints.shape[:-2])


class SkeletonAwareNetwork(nn.Module):
    """The rotations by which those of a source have to change for a target, frame by frame.

    It has 446,276 parameters. Its input and output are normalised with the statistics of training poses:
    also a change is read as deviations from the mean rotation.
    """

    def __init__(self, dropout: float = 0.0) -> None:
        super().__init__()
        self.scale = Normaliser(positions=3 * JOINTS, rotations=4 * JOINTS)
        self.motion = JointEncoder(4, MOTION, 4, dropout)
        self.body = JointEncoder(3, BODY, 2, dropout)
        self.join = nn.Linear(MOTION + 2 * BODY, BODY)
        self.change = nn.Linear(BODY, 4)
        self.dropout = nn.Dropout(dropout)
        self.register_buffer("order", joint_code(MOTION + 2 * BODY), persistent=False)

    order: Tensor

    def bones(self, offsets: Tensor) -> Tensor:
        """Codes ``(..., 22, 128)`` of bodies from their ``features.offsets`` ``(..., 22, 3)``."""
        code: Tensor = self.body(self.normal("positions", offsets))
        return code

    def normal(self, kind: str, values: Tensor) -> Tensor:
        """Positions ``(..., 22, 3)`` or rotations ``(..., 22, 4)`` as deviations from their means."""
        return self.scale.normalise(kind, values.flatten(-2)).reshape(values.shape)

    def forward(self, rotations: Tensor, source: Tensor, target: Tensor) -> Tensor:
        """Changes ``(..., 22, 4)``, unit quaternions: a target's rotation is the source's times its change.

        rotations: ``(..., 22, 4)`` of the source, see ``features.rotations``.
        source, target: codes of both bodies, broadcast to ``(..., 22, 128)``.
        """
        code = self.motion(self.normal("rotations", rotations))
        bodies = (each.expand(*code.shape[:-1], -1) for each in (source, target))
        joined = torch.cat([code, *bodies], -1)
        placed = self.dropout(joined * sqrt(joined.shape[-1]) + self.order)
        raw = self.change(self.dropout(functional.relu(self.join(placed)))).float()
        return rotation.normalise(self.scale.restore("rotations", raw.flatten(-2)).reshape(raw.shape))


def joint_code(width: int) -> Tensor:
    """``(22, width)`` the sinusoidal code of a joint's number: sines in even channels, cosines in odd."""
    rates = torch.exp(torch.arange(0, width, 2) * (-log(10_000.0) / width))
    angles = torch.arange(JOINTS).unsqueeze(1) * rates
    return torch.stack([angles.sin(), angles.cos()], -1).flatten(1)
