"""The local interaction of a block: two 3x3 convolutions of each channel over joints and frames.

Padding is zero before both, as what lies beyond the border of a sequence alone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable
from torch.nn import functional

from ..design import Design
from .attention import EPSILON
from .norms import BatchNorm, Inner, TokenNorm
from .tokens import Lines, image, lines

aten = torch.ops.aten


class Local(nn.Module):
    """Norm, convolution, GELU, the design's norm, convolution, and what came in."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.norm = nn.LayerNorm(width, EPSILON)
        self.first = nn.Conv2d(width, width, 3, padding=1, groups=width)
        self.inner: Inner = (BatchNorm if design.norm == "batch" else TokenNorm)(width, design.affine)
        self.second = nn.Conv2d(width, width, 3, padding=1, groups=width)
        self.scale = nn.Parameter(torch.full((width,), design.scale))

    @property
    def gathers(self) -> bool:
        """Whether what becomes of a token depends on all tokens of the batch: batch norm, in training."""
        return self.training and isinstance(self.inner, BatchNorm)

    def forward(self, tokens: Tensor, own: Lines) -> Tensor:
        """``(lines, frames, width)``."""
        bias = self.second.bias
        assert bias is not None
        weights = (
            *(self.norm.weight, self.norm.bias, self.first.weight, self.first.bias),
            *(self.second.weight * self.scale.view(-1, 1, 1, 1), bias * self.scale),
            *(self.inner.weight, self.inner.bias),
        )
        return _local(tokens, own, self.inner, *weights)


class _Local(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, tokens: Tensor, own: Lines, inner: Inner, *weights: Tensor | None) -> Tensor:
        scale, shift, first, first_bias, second, second_bias, *affine = weights
        assert scale is not None
        normed, mean, rate = torch.native_layer_norm(tokens, scale.shape, scale, shift, EPSILON)
        own.emptied_(normed)
        hidden = _convolved(normed, first, first_bias)
        between, numbers = inner.applied(functional.gelu(hidden), own, *affine)
        own.emptied_(between)
        result = _convolved(between, second, second_bias)
        ctx.own, ctx.inner, ctx.numbers = own, inner, len(numbers)
        ctx.save_for_backward(tokens, normed, mean, rate, hidden, between, *numbers, *weights)
        return result.add_(tokens)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        tokens, normed, mean, rate, hidden, between, *rest = ctx.saved_tensors
        numbers, weights = rest[: ctx.numbers], rest[ctx.numbers :]
        scale, shift, first, _, second, _, *affine = weights
        pull = pull.contiguous()
        given, *to_second = _pulled(pull, between, second)
        ctx.own.emptied_(given)
        given, *to_affine = ctx.inner.pulled(given, functional.gelu(hidden), ctx.own, numbers, *affine)
        given = aten.gelu_backward(given, hidden)
        given, *to_first = _pulled(given, normed, first)
        ctx.own.emptied_(given)
        own, *to_norm = aten.native_layer_norm_backward(
            given, tokens, scale.shape, mean, rate, scale, shift, [True, True, True]
        )
        return own.add_(pull), None, None, *to_norm, *to_first, *to_second, *to_affine


_local: Callable[..., Tensor] = _Local.apply


def _convolved(values: Tensor, weight: Tensor | None, bias: Tensor | None) -> Tensor:
    assert weight is not None
    return lines(functional.conv2d(image(values), weight, bias, padding=1, groups=len(weight)))


def _pulled(pull: Tensor, values: Tensor, weight: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Gradients of values, weight and bias of ``_convolved``."""
    width = len(weight)
    settings = ([width], [1, 1], [1, 1], [1, 1], False, [0, 0], width, [True, True, True])
    found = aten.convolution_backward(image(pull), image(values), weight, *settings)
    return lines(found[0]), found[1], found[2]
