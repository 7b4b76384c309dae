"""Cross-covariance attention (El-Nouby et al., 2021): channels attend to channels.

Queries, keys and values are linear in the tokens, and what is done to values is as well. So one matrix of
sums over tokens says everything about queries and keys, and one matrix does to a token all that projection,
attention, and projection would do: neither is ever applied to tokens one by one.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable
from torch.nn import functional

from ..design import Design
from .tokens import RaggedTokens

EPSILON = 1e-5
SMALLEST = 1e-12
"""The least norm of a channel, as torch normalises."""
FEW = 2
"""A sequence with fewer tokens than so many widths has its queries and keys worked out."""


class Sums(NamedTuple):
    """Sums over the tokens of each sequence.

    pairs: of outer products ``(rows, width, width)``. tokens: of the tokens ``(rows, width)``, or None.
    number: of tokens ``(rows,)``.
    """

    pairs: Tensor
    tokens: Tensor | None
    number: Tensor


class Attention(nn.Module):
    """Normalised tokens to what is added to tokens, of which the design's layer scale is a part.

    Padding counts for nothing: queries' and keys' norms and products are sums over real tokens.
    """

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.norm = nn.LayerNorm(width, EPSILON)
        self.qkv = nn.Linear(width, 3 * width, bias=design.biased)
        self.out = nn.Linear(width, width)
        self.temperature = nn.Parameter(torch.ones(design.heads, 1, 1))
        self.scale = nn.Parameter(torch.full((width,), design.scale))

    def forward(
        self, tokens: Tensor, ragged: RaggedTokens, kept: tuple[RaggedTokens, Tensor] | None = None
    ) -> Tensor:
        """``(tracks, frames, width)``; with ``kept`` only the tracks that it names."""
        biased = self.qkv.bias is not None
        normed, pairs, sums = _summed(tokens, self.norm.weight, self.norm.bias, ragged, biased)
        squares, scores = self.scores(Sums(pairs, sums, ragged.real))
        few = ragged.shorter_than(FEW * self.out.in_features)
        if few:
            own = [self._directly(ragged.sequence(normed, number)) for number in few]
            index = torch.tensor(few, device=normed.device)
            squares = squares.index_copy(0, index, torch.stack([each for each, _ in own]))
            scores = scores.index_copy(0, index, torch.stack([each for _, each in own]))
        matrices, bias = self.mixing(squares, scores)
        if kept is not None:
            ragged, index = kept
            tokens, normed = tokens[index], normed[index]
        return _mixed(tokens, normed, matrices, bias, ragged)

    def scores(self, sums: Sums) -> tuple[Tensor, Tensor]:
        """Over the tokens of each sequence, squares of queries and keys, and products of the two.

        ``(rows, 2, heads, size)`` and ``(rows, heads, size, size)``.
        """
        width, heads = self.out.in_features, len(self.temperature)
        rows, size = len(sums.pairs), width // heads
        asking = self.qkv.weight[: 2 * width]
        half = functional.linear(sums.pairs, asking)
        squares = (half * asking.T).sum(1)
        keys = half[..., width:].view(rows, width, heads, size)
        scores = torch.einsum("hiw,rwhj->rhij", asking[:width].view(heads, size, width), keys)
        if sums.tokens is not None:
            bias, total = self.qkv.bias[: 2 * width], functional.linear(sums.tokens, asking)
            count = sums.number.unsqueeze(1)
            squares = squares + bias * (2.0 * total + count * bias)
            first, second = bias.view(2, heads, size).unbind(0)
            queries, keys = total.view(rows, 2, heads, size).unbind(1)
            scores = scores + (queries + count.unsqueeze(2) * first).unsqueeze(3) * second.unsqueeze(1)
            scores = scores + first.unsqueeze(2) * keys.unsqueeze(2)
        return squares.view(rows, 2, heads, size), scores

    def _directly(self, normed: Tensor) -> tuple[Tensor, Tensor]:
        """The same from queries and keys of a sequence ``(tracks, frames, width)``, without ``rows``.

        Sums of few products say too little of a channel whose queries are all small.
        """
        width, heads = self.out.in_features, len(self.temperature)
        bias = None if self.qkv.bias is None else self.qkv.bias[: 2 * width]
        found = functional.linear(normed, self.qkv.weight[: 2 * width], bias)
        found = found.view(-1, 2, heads, width // heads)
        scores = torch.einsum("nhi,nhj->hij", found[:, 0], found[:, 1])
        return found.square().sum(0), scores

    def mixing(self, squares: Tensor, scores: Tensor) -> tuple[Tensor, Tensor]:
        """Matrix ``(rows, width, width)`` for the tokens of each sequence, and bias ``(rows, width)``."""
        short = squares.clamp(min=SMALLEST**2).rsqrt()
        cosines = (scores * short[:, 0].unsqueeze(3) * short[:, 1].unsqueeze(2)).clamp(-1.0, 1.0)
        weights = (cosines * self.temperature).softmax(3)
        return self._applied(weights, self.qkv.weight[2 * self.out.in_features :])

    def _applied(self, weights: Tensor, values: Tensor) -> tuple[Tensor, Tensor]:
        """weights: ``(rows, heads, size, size)``. values: what makes values of tokens."""
        heads, size = weights.shape[1:3]
        out = self.out.weight * self.scale.unsqueeze(1)
        found = torch.matmul(weights, values.view(heads, size, -1)).flatten(1, 2)
        bias = self.out.bias.expand(len(weights), -1) * self.scale
        if self.qkv.bias is not None:
            constant = self.qkv.bias[-len(values) :].view(heads, size, 1)
            bias = bias + functional.linear(torch.matmul(weights, constant).flatten(1), out)
        return functional.linear(found.transpose(1, 2), out), bias


class _Summed(torch.autograd.Function):
    """Normalised tokens, sums of their outer products, and of themselves.

    Without this backward pass a whole step takes 1.18 times as long (``paper_count``, preset ``paper``;
    1.03 times with ``small``): see ``tests/benchmarks/backward_passes.py``.
    """

    @staticmethod
    def forward(
        ctx: Any, tokens: Tensor, weight: Tensor, bias: Tensor, ragged: RaggedTokens, wanted: bool
    ) -> tuple[Tensor, Tensor, Tensor | None]:
        normed, mean, scale = torch.native_layer_norm(tokens, weight.shape, weight, bias, EPSILON)
        ragged.zero_padding_(normed)
        ctx.ragged = ragged
        ctx.save_for_backward(tokens, weight, bias, mean, scale, normed)
        return normed, ragged.products(normed, normed), ragged.sums(normed) if wanted else None

    @staticmethod
    @once_differentiable
    def backward(
        ctx: Any, output_gradient: Tensor, to_pairs: Tensor, to_sums: Tensor | None
    ) -> tuple[Tensor | None, ...]:
        tokens, weight, bias, mean, scale, normed = ctx.saved_tensors
        output_gradient = ctx.ragged.mixed(normed, to_pairs + to_pairs.transpose(1, 2), output_gradient)
        if to_sums is not None:
            ctx.ragged.added_(output_gradient, to_sums)
        ctx.ragged.zero_padding_(output_gradient)
        found = torch.ops.aten.native_layer_norm_backward(
            output_gradient, tokens, weight.shape, mean, scale, weight, bias, [True, True, True]
        )
        return (*found, None, None)


class _Mixed(torch.autograd.Function):
    """Tokens, and normalised tokens times matrices, and a vector for all tokens of a sequence.

    Without this backward pass a whole step takes 1.22 times as long (``paper_count``, preset ``paper``;
    1.00 times with ``small``): see ``tests/benchmarks/backward_passes.py``.
    """

    @staticmethod
    def forward(
        ctx: Any, tokens: Tensor, normed: Tensor, matrices: Tensor, bias: Tensor, ragged: RaggedTokens
    ) -> Tensor:
        ctx.ragged = ragged
        ctx.save_for_backward(normed, matrices)
        result = ragged.mixed(normed, matrices, tokens)
        return ragged.added_(result, bias)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, output_gradient: Tensor) -> tuple[Tensor | None, ...]:
        normed, matrices = ctx.saved_tensors
        output_gradient = output_gradient.contiguous()
        to_normed = ctx.ragged.mixed(output_gradient, matrices.transpose(1, 2))
        return (
            output_gradient,
            to_normed,
            ctx.ragged.products(normed, output_gradient),
            ctx.ragged.sums(output_gradient),
            None,
        )


_summed: Callable[..., tuple[Tensor, Tensor, Tensor | None]] = _Summed.apply
_mixed: Callable[..., Tensor] = _Mixed.apply
