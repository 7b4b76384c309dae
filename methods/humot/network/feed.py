"""The feed-forward layers of a block: norm, wide layer, GELU, narrow layer, and what came in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from ..design import Design
from .attention import EPSILON

aten = torch.ops.aten


class Feed(nn.Module):
    """Token by token, some at a time; what is wide is kept once, before GELU."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.norm = nn.LayerNorm(width, EPSILON)
        self.wide = nn.Linear(width, design.expansion * width)
        self.narrow = nn.Linear(design.expansion * width, width)
        self.scale = nn.Parameter(torch.full((width,), design.scale))

    def forward(self, tokens: Tensor, pieces: list[slice]) -> Tensor:
        """``(lines, frames, width)``; what is in no piece of all tokens comes out as zeros."""
        return _fed(tokens, pieces, *self.weights())

    def weights(self) -> tuple[Tensor, ...]:
        """Norm, wide layer, and narrow layer with the layer scale in it."""
        return (
            *(self.norm.weight, self.norm.bias, self.wide.weight, self.wide.bias),
            *(self.narrow.weight * self.scale.unsqueeze(1), self.narrow.bias * self.scale),
        )


class _Fed(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, tokens: Tensor, pieces: list[slice], *weights: Tensor) -> Tensor:
        scale, shift, wide, wide_bias, narrow, narrow_bias = weights
        flat, result = tokens.flatten(0, 1), torch.zeros_like(tokens)
        keeping = any(ctx.needs_input_grad)
        room = flat.new_empty(len(flat) if keeping else _largest(pieces), len(wide))
        spare, found = flat.new_empty(_largest(pieces), len(wide)), result.flatten(0, 1)
        for piece in pieces:
            values = flat[piece]
            hidden = room[piece] if keeping else room[: len(values)]
            normed = torch.native_layer_norm(values, scale.shape, scale, shift, EPSILON)[0]
            torch.addmm(wide_bias, normed, wide.T, out=hidden)
            bent = aten.gelu.out(hidden, out=spare[: len(values)])
            torch.addmm(values, bent, narrow.T, out=found[piece]).add_(narrow_bias)
        ctx.pieces = pieces
        ctx.save_for_backward(tokens, room, *weights)
        return result

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        tokens, room, *weights = ctx.saved_tensors
        scale, shift, wide, _, narrow, _ = weights
        found = [torch.zeros_like(each) for each in weights]
        flat, pull, result = tokens.flatten(0, 1), pull.flatten(0, 1), torch.zeros_like(tokens)
        spare = flat.new_empty(2, _largest(ctx.pieces), len(wide))
        for piece in ctx.pieces:
            values, given, hidden = flat[piece], pull[piece], room[piece]
            bent, inner = spare[:, : len(values)].unbind(0)
            aten.gelu.out(hidden, out=bent)
            found[4].addmm_(given.T, bent)
            found[5] += given.sum(0)
            torch.mm(given, narrow, out=inner)
            aten.gelu_backward.grad_input(inner, hidden, grad_input=inner)
            normed, mean, rate = torch.native_layer_norm(values, scale.shape, scale, shift, EPSILON)
            found[2].addmm_(inner.T, normed)
            found[3] += inner.sum(0)
            inner = torch.mm(inner, wide)
            own, *norm = aten.native_layer_norm_backward(
                inner, values, scale.shape, mean, rate, scale, shift, [True, True, True]
            )
            found[0] += norm[0]
            found[1] += norm[1]
            torch.add(own, given, out=result.view_as(flat)[piece])
        return result, None, *found


_fed: Callable[..., Tensor] = _Fed.apply


def _largest(pieces: list[slice]) -> int:
    return max((piece.stop - piece.start for piece in pieces), default=0)
