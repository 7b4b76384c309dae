"""Attention within body parts (section 4.2): tokens gather what the slots of their parts say.

Everything here is one frame's affair. Rows are the tokens of the parts, then slots; channels come first and
frames last, ``(width, rows, frames)``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable
from torch.nn import functional

from ..design import Design
from .core import attend, weigh
from .dropout import Noise
from .plan import Group, Parts
from .wide import wide


class Attention(nn.Module):
    """One layer of attention (eq. 4 and 5).

    With a ``feedforward`` width it is a transformer's, see ``Block``; else it is the equations and no more.
    """

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.heads = design.heads
        self.qkv = nn.Linear(width, 3 * width)
        nn.init.xavier_uniform_(self.qkv.weight)
        nn.init.zeros_(self.qkv.bias)
        self.block = Block(design) if design.feedforward else None

    def forward(self, rows: Tensor, groups: Sequence[Group], noise: Noise | None) -> Tensor:
        """``(width, queries, frames)`` from ``(width, rows, frames)``; groups: of the first rows."""
        width = len(rows)
        asking = rows[:, : groups[-1].queries.stop]
        found = attend(self._linear(asking, 0, 1), self._linear(rows, 1, 3), groups, self.heads, noise)
        if self.block is None:
            return found
        shape = found.shape
        return self.block(asking.reshape(width, -1), found.view(width, -1), noise).view(shape)

    def weights(self, rows: Tensor, group: Group) -> Tensor:
        """How much each query heeds each key ``(queries, keys, frames)``: the mean over heads."""
        queries, keys = self._linear(rows, 0, 2).view(2, self.heads, -1, *rows.shape[1:]).unbind(0)
        return weigh(queries[:, :, group.queries], keys[:, :, list(group.keys)]).mean(0)

    def _linear(self, rows: Tensor, start: int, stop: int) -> Tensor:
        """Some of queries, keys and values: ``((stop - start) * width, rows, frames)``."""
        width = len(rows)
        chosen = slice(start * width, stop * width)
        bias = self.qkv.bias[chosen].unsqueeze(1)
        flat = torch.addmm(bias, self.qkv.weight[chosen], rows.reshape(width, -1))
        return flat.view(-1, *rows.shape[1:])


class Block(nn.Module):
    """What stands behind the attention of a transformer.

    A projection and a block that is wide inside (GELU), each with dropout, residual and norm behind it.
    """

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.out = nn.Linear(width, width)
        nn.init.zeros_(self.out.bias)
        self.norms = nn.ModuleList([nn.LayerNorm(width), nn.LayerNorm(width)])
        self.feed = nn.ModuleList(
            [nn.Linear(width, design.feedforward), nn.Linear(design.feedforward, width)]
        )

    def forward(self, rows: Tensor, found: Tensor, noise: Noise | None) -> Tensor:
        """rows: ``(width, columns)`` that asked. found: what they found."""
        projected = torch.addmm(self.out.bias.unsqueeze(1), self.out.weight, found)
        first, second = self.norms
        rows = _added(rows, projected, first, noise)
        return _added(rows, wide(rows, self.feed, "gelu", noise), second, noise)


class Mean(nn.Module):
    """In the place of attention where that is left out: a linear layer, rectified, and means of parts.

    parts: positions of the slots of each.
    """

    def __init__(self, design: Design, parts: Parts) -> None:
        super().__init__()
        self.leak, self.parts = design.leak, parts
        self.linear = nn.Linear(design.width, design.width)

    def forward(self, slots: Tensor) -> tuple[Tensor, Tensor]:
        """``(width, parts, frames)`` and the new slots, from slots ``(width, slots, frames)``."""
        flat = torch.addmm(self.linear.bias.unsqueeze(1), self.linear.weight, slots.reshape(len(slots), -1))
        slots = functional.leaky_relu(flat, self.leak).view(slots.shape)
        return torch.stack([slots[:, list(part)].mean(1) for part in self.parts], 1), slots


def _added(rows: Tensor, more: Tensor, norm: nn.Module, noise: Noise | None) -> Tensor:
    """Residual and layer norm over channels, ``(width, columns)``; dropout of what is added."""
    return _normal(rows, more, norm.weight, norm.bias, norm.eps, noise)


class _Added(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        rows: Tensor,
        more: Tensor,
        weight: Tensor,
        bias: Tensor,
        least: float,
        noise: Noise | None,
    ) -> Tensor:
        ctx.noise, ctx.drawn = noise, None if noise is None else noise.bytes(*more.shape)
        total = rows + more if noise is None else torch.addcmul(rows, more, noise.kept(ctx.drawn, more))
        total -= total.mean(0)
        over = (total * total).mean(0).add_(least).rsqrt_()
        total *= over
        ctx.save_for_backward(total, over, weight)
        return torch.addcmul(bias.unsqueeze(1), total, weight.unsqueeze(1))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        normal, over, weight = ctx.saved_tensors
        along = pull * normal
        to_weight, to_bias = along.sum(1), pull.sum(1)
        count = len(weight)
        share = (weight / count) @ torch.stack([along, pull]).view(2, count, -1)
        found = torch.addcmul(pull * weight.unsqueeze(1), normal, share[0], value=-1.0)
        found = found.sub_(share[1]).mul_(over)
        to_more = found if ctx.noise is None else found * ctx.noise.kept(ctx.drawn, found)
        return found, to_more, to_weight, to_bias, None, None


_normal: Callable[..., Tensor] = _Added.apply
