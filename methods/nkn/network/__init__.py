"""NKN's networks: a recurrent encoder, and a decoder that sees what it answered the frame before."""

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from retarget_bench.training.layers.kinematic.pose import MOVES, Scale

from .bodies import Bodies
from .cells import Kind, Layer, dropped, raised, unrounded
from .rollout import Drops, Memory, Rolled, Rollout, Weights

KEEP = 0.9
"""Dropout's share of inputs of GRU layers that is kept."""


class Encoder(nn.Module):
    """Two GRU layers over normalised poses."""

    def __init__(self, joints: int, hidden: int, cell: Kind) -> None:
        super().__init__()
        self.lower = Layer(3 * joints + MOVES, hidden, cell)
        self.upper = Layer(hidden, hidden, cell)

    def forward(self, poses: Tensor, start: Sequence[Tensor] = ()) -> tuple[Tensor, Tensor]:
        """States ``(frames, rows, hidden)`` of the lower and the upper layer.

        poses: ``(frames, rows, channels)``. start: where both layers begin, ``(rows, hidden)``; else zero.
        """
        rest = poses.new_zeros(poses.shape[1], self.lower.hidden)
        below, above = start or (rest, rest)
        lower = self.lower(self._thinned(poses), below)
        return lower, self.upper(self._thinned(lower), above)

    def _thinned(self, inputs: Tensor) -> Tensor:
        return inputs * dropped(inputs, KEEP) if self.training else inputs


class Decoder(nn.Module):
    """Two GRU layers on bones, the answer before and the encoder's state, and forward kinematics."""

    def __init__(self, joints: int, hidden: int, cell: Kind) -> None:
        super().__init__()
        self.bones, self.channels = 3 * (joints - 1), 3 * joints + MOVES
        self.lower = Layer(self.bones + self.channels + hidden, hidden, cell)
        self.upper = Layer(hidden, hidden, cell)
        self.out = nn.Parameter(torch.randn(hidden, 4 * joints + MOVES) * 0.002)
        self.out_bias = nn.Parameter(torch.zeros(4 * joints + MOVES))
        self.out_bias.data[: 4 * joints : 4] = 1.0

    def forward(
        self, codes: Tensor, bodies: Bodies, memory: Memory | None = None
    ) -> tuple[Tensor, Tensor, Memory]:
        """Poses ``(frames, rows, channels)``, raw outputs ``(frames, rows, 4 joints + 4)``, and the memory
        to go on with; no gradient flows through a memory.

        codes: ``(frames, rows, hidden)`` the encoder's states. The first 4 joints of the raw outputs are
        quaternions that are not of unit length.
        """
        frames, rows, hidden = codes.shape
        if memory is None:
            rest = codes.new_zeros(rows, hidden)
            pose, rise = codes.new_zeros(rows, self.channels), codes.new_zeros(rows, 1)
            memory = Memory(rest, rest, pose, rise, first=True)
        before, after = self.lower.kernel[: self.bones], self.lower.kernel[self.bones + self.channels :]
        bones, drops = bodies.bones.expand(frames, -1, -1) if self.training else bodies.bones[None], None
        if self.training:
            fed = dropped(codes.new_empty(frames, rows, self.channels), KEEP)
            drops = Drops(fed, dropped(codes, KEEP))
            bones, codes = bones * dropped(bones, KEEP), codes * dropped(codes, KEEP)
        projected = raised(codes @ after) + (raised(bones @ before) + self.lower.bias)
        rollout = Rollout(self.lower.cell, bodies, drops, memory)
        if torch.is_grad_enabled():
            with unrounded(projected):
                poses, raw = Rolled.apply(rollout, projected, *self._weights)  # type: ignore[no-untyped-call]
        else:
            poses, raw = rollout.answers(projected, self._weights)
        return poses, raw, rollout.memory

    @property
    def _weights(self) -> Weights:
        lower, upper = self.lower, self.upper
        return Weights(
            fed=lower.kernel[self.bones : self.bones + self.channels],
            lower=lower.weights,
            lower_bias=lower.state_bias,
            kernel=upper.kernel,
            bias=upper.bias,
            upper=upper.weights,
            upper_bias=upper.state_bias,
            out=self.out,
            out_bias=self.out_bias,
        )


class Generator(nn.Module):
    """The encoder and the decoder of one structure, and the scale of its numbers."""

    def __init__(self, joints: int, hidden: int, cell: Kind) -> None:
        super().__init__()
        self.scale = Scale(joints)
        self.encoder = Encoder(joints, hidden, cell)
        self.decoder = Decoder(joints, hidden, cell)
