"""What a frame's joints have in common, told to each of them: the mirror image of the decoder's styles.

Attention between channels tells tokens about sequences as a whole, and the local interaction about two
neighbours a block, so that a latent token sees few joints of its own frame but in deep networks. Here every
channel is averaged over a frame's joints, those near an anchor of its own in the neutral pose.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from ..design import Design
from .anchors import Anchors
from .attention import EPSILON
from .beginning import spread
from .tokens import Lines


class Common(nn.Module):
    """A linear layer of a frame's mean, and what came in."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.norm = nn.LayerNorm(width, EPSILON)
        self.anchors = Anchors(width)
        self.mean = nn.LayerNorm(width, EPSILON)
        self.told = nn.Linear(width, width)
        spread([self.told], 1.0)

    def forward(self, tokens: Tensor, template: Tensor, lines: Lines) -> Tensor:
        """``(lines, frames, width)``. template: ``(joints, 3)`` metres, of all sequences."""
        near = _by_sequence(self.anchors(template), lines)
        shares = torch.cat([each.softmax(0) for each in near])
        means = _means(self.norm(tokens), shares, lines)
        return _added(tokens, self.told(self.mean(means)), lines)


class _Means(torch.autograd.Function):
    """Of each sequence's tokens, but the latent one, the sum over joints of shares ``(joints, width)`` of
    them ``(rows, frames, width)``."""

    @staticmethod
    def forward(ctx: Any, tokens: Tensor, shares: Tensor, lines: Lines) -> Tensor:
        ctx.lines = lines
        ctx.save_for_backward(tokens, shares)
        parts = zip(lines.over(tokens), _by_sequence(shares, lines), strict=True)
        return torch.stack([torch.einsum("jfw,jw->fw", own[1:], each) for own, each in parts])

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        lines, (tokens, shares) = ctx.lines, ctx.saved_tensors
        result, to_shares = torch.zeros_like(tokens), torch.empty_like(shares)
        sides = (
            lines.over(tokens),
            lines.over(result),
            *(_by_sequence(s, lines) for s in (shares, to_shares)),
        )
        for given, own, found, each, total in zip(pull, *sides, strict=True):
            torch.mul(given.unsqueeze(0), each.unsqueeze(1), out=found[1:])
            total.copy_(torch.einsum("jfw,fw->jw", own[1:], given))
        return result, to_shares, None


class _Added(torch.autograd.Function):
    """Tokens, and on each line of a sequence what it is told ``(rows, frames, width)``."""

    @staticmethod
    def forward(ctx: Any, tokens: Tensor, told: Tensor, lines: Lines) -> Tensor:
        ctx.lines = lines
        result = torch.zeros_like(tokens)
        for found, own, each in zip(lines.over(result), lines.over(tokens), told, strict=True):
            torch.add(own, each, out=found)
        return result

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        return pull, torch.stack([given.sum(0) for given in ctx.lines.over(pull)]), None


_means: Callable[[Tensor, Tensor, Lines], Tensor] = _Means.apply
_added: Callable[[Tensor, Tensor, Lines], Tensor] = _Added.apply


def _by_sequence(values: Tensor, lines: Lines) -> tuple[Tensor, ...]:
    """``(joints, width)`` of each sequence."""
    return torch.split(values, [count - 1 for count in lines.counts])
