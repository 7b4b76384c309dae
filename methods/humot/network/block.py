"""A transformer block after XCiT: attention between channels, local interaction, feed-forward layers."""

from collections.abc import Callable
from itertools import product
from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable
from torch.nn import functional

from ..design import Design
from .attention import EPSILON, Attention, Sums
from .tokens import RaggedTokens, as_image, from_image, pieces_of

LONG = 1 << 14
"""Tokens of a sequence beyond which it is read in parts, where no gradients are wanted."""
SIDE = (32, 64)
"""Tracks and frames of a part."""
HALO = 2
"""How far the two convolutions of the local interaction reach."""
Part = tuple[slice, slice]


class Block(nn.Module):
    """Three residual steps, each with its norm before and its layer scale behind it."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        self.attention = Attention(design)
        self.local = Local(design)
        self.feed = FeedForward(design)

    def forward(self, tokens: Tensor, ragged: RaggedTokens, kept: int | None = None) -> Tensor:
        """``(tracks, frames, width)``; with ``kept``, only so many first tracks of each sequence.

        What the other ones would become is then worked out only for statistics over a batch.
        """
        separable = not self.local.gathers
        if separable and not torch.is_grad_enabled() and ragged.length * max(ragged.counts) > LONG:
            return self._in_parts(tokens, ragged, kept)
        chosen = ragged.first(kept + HALO) if separable and kept is not None else None
        tokens = self.attention(tokens, ragged, chosen)
        ragged = ragged if chosen is None else chosen[0]
        tokens = self.local(tokens, ragged)
        if kept is not None:
            ragged, index = ragged.first(kept)
            tokens = tokens[index]
        return self.feed(tokens, ragged.pieces)

    def _in_parts(self, tokens: Tensor, ragged: RaggedTokens, kept: int | None) -> Tensor:
        """The same with little memory besides tokens and result."""
        out = ragged if kept is None else ragged.first(kept)[0]
        result = tokens.new_zeros(out.total, *tokens.shape[1:])
        for number, (own, found) in enumerate(zip(ragged.over(tokens), out.over(result), strict=True)):
            own = own[:, : ragged.lengths[number]]
            matrix, bias = self.attention.mixing(*self.attention.scores(self._sums(own)))
            for part in _parts(len(found), own.shape[1]):
                found[part] = self._part(own, part, matrix[0], bias[0])
        return result

    def _sums(self, own: Tensor) -> Sums:
        """Of one sequence ``(tracks, frames, width)``."""
        tracks, length, width = own.shape
        pairs, total = own.new_zeros(width, width), own.new_zeros(width)
        for part in _parts(tracks, length):
            normed = self.attention.norm(own[part]).flatten(0, 1)
            pairs.addmm_(normed.T, normed)
            total += normed.sum(0)
        biased = self.attention.qkv.bias is not None
        number = own.new_full((1,), tracks * length)
        return Sums(pairs.unsqueeze(0), total.unsqueeze(0) if biased else None, number)

    def _part(self, own: Tensor, part: Part, matrix: Tensor, bias: Tensor) -> Tensor:
        """What becomes of a part of a sequence, for which a rim around it is read."""
        pairs = list(zip(part, own.shape[:2], strict=True))
        rim = [slice(max(side.start - HALO, 0), min(side.stop + HALO, size)) for side, size in pairs]
        read = own[rim[0], rim[1]]
        normed = self.attention.norm(read)
        mixed = torch.addmm(bias, normed.flatten(0, 1), matrix).view(read.shape).add_(read)
        ragged = RaggedTokens([len(read)], read.shape[1], None, read.device)
        mixed = self.local(functional.pad(mixed, (0, 0, 0, 0, 0, 1)), ragged)
        inner = [
            slice(side.start - each.start, side.stop - each.start)
            for side, each in zip(part, rim, strict=True)
        ]
        kept = mixed[inner[0], inner[1]].contiguous()
        return self.feed(kept, pieces_of(slice(0, kept.shape[0] * kept.shape[1])))


def _parts(tracks: int, length: int) -> list[Part]:
    sides = [
        [slice(start, min(start + side, size)) for start in range(0, size, side)]
        for side, size in zip(SIDE, (tracks, length), strict=True)
    ]
    return list(product(*sides))


class Local(nn.Module):
    """Norm, convolution, GELU, the design's norm, convolution, and what came in."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.norm = nn.LayerNorm(width, EPSILON)
        self.first = nn.Conv2d(width, width, 3, padding=1, groups=width)
        self.inner: nn.Module = (BatchNorm if design.norm == "batch" else TokenNorm)(width, design.affine)
        self.second = nn.Conv2d(width, width, 3, padding=1, groups=width)
        self.scale = nn.Parameter(torch.full((width,), design.scale))

    @property
    def gathers(self) -> bool:
        """Whether what becomes of a token depends on all tokens of the batch: batch norm, in training."""
        return self.training and isinstance(self.inner, BatchNorm)

    def forward(self, tokens: Tensor, own: RaggedTokens) -> Tensor:
        """``(tracks, frames, width)``."""
        hidden = functional.gelu(
            _convolved(own.zero_padding_(self.norm(tokens)), self.first.weight, self.first.bias)
        )
        between = own.zero_padding_(self.inner(hidden, own))
        bias = self.second.bias
        assert bias is not None
        weight = self.second.weight * self.scale.view(-1, 1, 1, 1)
        return tokens + _convolved(between, weight, bias * self.scale)


def _convolved(values: Tensor, weight: Tensor, bias: Tensor | None) -> Tensor:
    return from_image(functional.conv2d(as_image(values), weight, bias, padding=1, groups=len(weight)))


MOMENTUM = 0.1


class TokenNorm(nn.Module):
    """Layer norm over the channels of each token."""

    def __init__(self, width: int, affine: bool) -> None:
        super().__init__()
        self.width = width
        self.weight = nn.Parameter(torch.ones(width)) if affine else None
        self.bias = nn.Parameter(torch.zeros(width)) if affine else None

    def forward(self, values: Tensor, own: RaggedTokens) -> Tensor:
        """``(tracks, frames, width)``."""
        return functional.layer_norm(values, (self.width,), self.weight, self.bias, EPSILON)


class BatchNorm(nn.Module):
    """Batch norm over the real tokens of a batch; in evaluation, with the running mean and variance."""

    mean: Tensor
    variance: Tensor

    def __init__(self, width: int, affine: bool) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.ones(width)) if affine else None
        self.bias = nn.Parameter(torch.zeros(width)) if affine else None
        self.register_buffer("mean", torch.zeros(width))
        self.register_buffer("variance", torch.ones(width))

    def forward(self, values: Tensor, own: RaggedTokens) -> Tensor:
        """``(tracks, frames, width)``."""
        mean, variance = self._counted(values, own) if self.training else (self.mean, self.variance)
        rate = (variance + EPSILON).rsqrt()
        slope = rate if self.weight is None else rate * self.weight
        start = -mean * slope if self.bias is None else self.bias - mean * slope
        return torch.addcmul(start, values, slope)

    def _counted(self, values: Tensor, own: RaggedTokens) -> tuple[Tensor, Tensor]:
        """Mean and variance of real tokens; the running ones follow."""
        flat, count = own.zero_padding_(values).flatten(0, 1), own.real.sum()
        mean = flat.sum(0) / count
        missing = len(flat) - count
        variance = ((flat - mean).square().sum(0) - missing * mean.square()).clamp(min=0.0) / count
        with torch.no_grad():
            self.mean.lerp_(mean, MOMENTUM)
            self.variance.lerp_(variance * count / (count - 1.0).clamp(min=1.0), MOMENTUM)
        return mean, variance


aten = torch.ops.aten


class FeedForward(nn.Module):
    """Token by token, some at a time; what is wide is kept once, before GELU."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.norm = nn.LayerNorm(width, EPSILON)
        self.wide = nn.Linear(width, design.expansion * width)
        self.narrow = nn.Linear(design.expansion * width, width)
        self.scale = nn.Parameter(torch.full((width,), design.scale))

    def forward(self, tokens: Tensor, pieces: list[slice]) -> Tensor:
        """``(tracks, frames, width)``; what is in no piece of all tokens comes out as zeros."""
        return _feed_forward(tokens, pieces, *self.weights())

    def weights(self) -> tuple[Tensor, ...]:
        """Norm, wide layer, and narrow layer with the layer scale in it."""
        return (
            *(self.norm.weight, self.norm.bias, self.wide.weight, self.wide.bias),
            *(self.narrow.weight * self.scale.unsqueeze(1), self.narrow.bias * self.scale),
        )


class _FeedForward(torch.autograd.Function):
    """Norm, hidden layer, GELU, output layer and residual, a piece at a time.

    Without this backward pass a whole step takes 1.15 times as long (``paper_count``, preset ``paper``;
    1.01 times with ``small``): see ``tests/benchmarks/backward_passes.py``.
    """

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
            active = aten.gelu.out(hidden, out=spare[: len(values)])
            torch.addmm(values, active, narrow.T, out=found[piece]).add_(narrow_bias)
        ctx.pieces = pieces
        ctx.save_for_backward(tokens, room, *weights)
        return result

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, output_gradient: Tensor) -> tuple[Tensor | None, ...]:
        tokens, room, *weights = ctx.saved_tensors
        scale, shift, wide, _, narrow, _ = weights
        found = [torch.zeros_like(each) for each in weights]
        flat, output_gradient, result = (
            tokens.flatten(0, 1),
            output_gradient.flatten(0, 1),
            torch.zeros_like(tokens),
        )
        spare = flat.new_empty(2, _largest(ctx.pieces), len(wide))
        for piece in ctx.pieces:
            values, given, hidden = flat[piece], output_gradient[piece], room[piece]
            active, inner = spare[:, : len(values)].unbind(0)
            aten.gelu.out(hidden, out=active)
            found[4].addmm_(given.T, active)
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


_feed_forward: Callable[..., Tensor] = _FeedForward.apply


def _largest(pieces: list[slice]) -> int:
    return max((piece.stop - piece.start for piece in pieces), default=0)
