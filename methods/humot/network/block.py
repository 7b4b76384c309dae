"""A transformer block after XCiT: attention between channels, local interaction, feed-forward layers.

Cross-covariance attention (El-Nouby et al., 2021): channels attend to channels. Queries, keys and values
are linear in the tokens, and what is done to values is as well. So one matrix of sums over tokens says
everything about queries and keys, and one matrix does to a token all that projection, attention and
projection would do: neither is ever applied to tokens one by one.
"""

from itertools import product

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.training.phases import to_device

from ..settings import Design
from .tokens import HALO, RaggedTokens

EPSILON = 1e-5
SMALLEST = 1e-12
"""The least norm of a channel, as torch normalises."""
FEW = 2
"""A sequence with fewer tokens than so many widths has its queries and keys worked out."""
LONG = 1 << 14
"""Tokens of a sequence beyond which it is read in parts, where no gradients are needed."""
SIDE = (32, 64)
"""Tracks and frames of a part."""
MOMENTUM = 0.1


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
        self, tokens: Tensor, ragged: RaggedTokens, selection: tuple[RaggedTokens, Tensor] | None = None
    ) -> Tensor:
        """``(tracks, frames, width)``; with ``selection`` only the tracks that it names."""
        normed = ragged.zero_padding_(self.norm(tokens))
        sequences = ragged.over(normed)
        flat = [each.flatten(0, 1) for each in sequences]
        pairs = torch.stack([each.T @ each for each in flat])
        squares, scores = self.scores(pairs, torch.stack([each.sum(0) for each in flat]), ragged.real)
        sizes = list(zip(ragged.counts, ragged.lengths, strict=True))
        few = [n for n, (count, length) in enumerate(sizes) if count * length < FEW * normed.shape[-1]]
        if few:
            every = list(zip(squares.unbind(), scores.unbind(), strict=True))
            for n in few:
                every[n] = self._directly(sequences[n][: sizes[n][0], : sizes[n][1]])
            squares, scores = (torch.stack(each) for each in zip(*every, strict=True))
        matrices, bias = self.mixing(squares, scores)
        if selection is not None:
            ragged, index = selection
            tokens = tokens[index]
            flat = [each.flatten(0, 1) for each in ragged.over(normed[index])]
        triples = zip(bias, flat, matrices, strict=True)
        return tokens + torch.cat([torch.addmm(*each) for each in triples]).view_as(tokens)

    def scores(self, pairs: Tensor, total: Tensor, number: Tensor) -> tuple[Tensor, Tensor]:
        """Over the tokens of each sequence, squares of queries and keys, and products of the two.

        ``(rows, 2, heads, size)`` and ``(rows, heads, size, size)``. Given are the sum of outer products of
        tokens ``(rows, width, width)``, that of tokens ``(rows, width)``, and their number ``(rows,)``.
        """
        width, heads = self.out.in_features, len(self.temperature)
        rows, size = len(pairs), width // heads
        asking = self.qkv.weight[: 2 * width]
        half = functional.linear(pairs, asking)
        squares = (half * asking.T).sum(1)
        keys = half[..., width:].view(rows, width, heads, size)
        scores = torch.einsum("hiw,rwhj->rhij", asking[:width].view(heads, size, width), keys)
        if self.qkv.bias is not None:
            bias, total = self.qkv.bias[: 2 * width], functional.linear(total, asking)
            count = number.unsqueeze(1)
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
        projected = functional.linear(normed, self.qkv.weight[: 2 * width], bias)
        projected = projected.view(-1, 2, heads, width // heads)
        scores = torch.einsum("nhi,nhj->hij", projected[:, 0], projected[:, 1])
        return projected.square().sum(0), scores

    def mixing(self, squares: Tensor, scores: Tensor) -> tuple[Tensor, Tensor]:
        """Matrix ``(rows, width, width)`` for the tokens of each sequence, and bias ``(rows, width)``."""
        short = squares.clamp(min=SMALLEST**2).rsqrt()
        cosines = (scores * short[:, 0].unsqueeze(3) * short[:, 1].unsqueeze(2)).clamp(-1.0, 1.0)
        weights = (cosines * self.temperature).softmax(3)
        heads, size = weights.shape[1:3]
        values = self.qkv.weight[-heads * size :].view(heads, size, -1)
        out = self.out.weight * self.scale.unsqueeze(1)
        bias = self.out.bias.expand(len(weights), -1) * self.scale
        if self.qkv.bias is not None:
            constant = self.qkv.bias[-heads * size :].view(heads, size, 1)
            bias = bias + functional.linear(torch.matmul(weights, constant).flatten(1), out)
        mixed = torch.matmul(weights, values).flatten(1, 2)
        return functional.linear(mixed.transpose(1, 2), out), bias


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
        flat, count = own.zero_padding_(values).flatten(0, 1).to(self.mean), own.real.sum()
        mean = flat.sum(0) / count
        missing = len(flat) - count
        variance = ((flat - mean).square().sum(0) - missing * mean.square()).clamp(min=0.0) / count
        with torch.no_grad():
            self.mean.lerp_(mean, MOMENTUM)
            self.variance.lerp_(variance * count / (count - 1.0).clamp(min=1.0), MOMENTUM)
        return mean, variance


class Local(nn.Module):
    """Norm, convolution, GELU, the design's norm, convolution, and what came in."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.norm = nn.LayerNorm(width, EPSILON)
        self.first = nn.Conv2d(width, width, 3, padding=1, groups=width)
        self.inner: BatchNorm | nn.LayerNorm = (
            BatchNorm(width, design.affine)
            if design.norm == "batch"
            else nn.LayerNorm(width, EPSILON, design.affine)
        )
        self.second = nn.Conv2d(width, width, 3, padding=1, groups=width)
        self.scale = nn.Parameter(torch.full((width,), design.scale))

    def forward(self, tokens: Tensor, own: RaggedTokens) -> Tensor:
        """``(tracks, frames, width)``."""
        first, second = self.first, self.second
        assert second.bias is not None
        hidden = _convolved(own.zero_padding_(self.norm(tokens)), first.weight, first.bias)
        hidden = functional.gelu(hidden)
        hidden = self.inner(hidden, own) if isinstance(self.inner, BatchNorm) else self.inner(hidden)
        weight = second.weight * self.scale.view(-1, 1, 1, 1)
        return tokens + _convolved(own.zero_padding_(hidden), weight, second.bias * self.scale)


def _convolved(values: Tensor, weight: Tensor, bias: Tensor | None) -> Tensor:
    """Tracks ``(tracks, frames, width)`` as a picture: every channel with its own 3x3 weights."""
    picture = values.unsqueeze(0).permute(0, 3, 1, 2)
    convolved = functional.conv2d(picture, weight, bias, padding=1, groups=len(weight))
    return convolved.permute(0, 2, 3, 1).squeeze(0).contiguous()


class FeedForward(nn.Module):
    """Token by token: norm, hidden layer, GELU, output layer, and what came in."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.norm = nn.LayerNorm(width, EPSILON)
        self.wide = nn.Linear(width, design.expansion * width)
        self.narrow = nn.Linear(design.expansion * width, width)
        self.scale = nn.Parameter(torch.full((width,), design.scale))

    def forward(self, tokens: Tensor) -> Tensor:
        """``(tracks, frames, width)``."""
        hidden = functional.gelu(self.wide(self.norm(tokens)))
        weight = self.narrow.weight * self.scale.unsqueeze(1)
        return tokens + functional.linear(hidden, weight, self.narrow.bias * self.scale)


class Block(nn.Module):
    """Three residual steps, each with its norm before and its layer scale behind it."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        self.attention = Attention(design)
        self.local = Local(design)
        self.feed = FeedForward(design)

    def forward(self, tokens: Tensor, ragged: RaggedTokens, latent: bool = False) -> Tensor:
        """``(tracks, frames, width)``; with ``latent``, of each sequence only the latent track.

        What the other ones would become is then worked out only for statistics over a batch.
        """
        separable = not (self.training and isinstance(self.local.inner, BatchNorm))
        if separable and not torch.is_grad_enabled() and ragged.length * max(ragged.counts) > LONG:
            return self._in_parts(tokens, ragged, latent)
        chosen = ragged.near if separable and latent else None
        tokens = self.attention(tokens, ragged, chosen)
        ragged = ragged if chosen is None else chosen[0]
        tokens = self.local(tokens, ragged)
        return self.feed(tokens[ragged.first] if latent else tokens)

    def _in_parts(self, tokens: Tensor, ragged: RaggedTokens, latent: bool) -> Tensor:
        """The same with little memory besides tokens and result."""
        counts = [2 if latent else count + 1 for count in ragged.counts]
        result = tokens.new_zeros(sum(counts), *tokens.shape[1:])
        parts = zip(ragged.over(tokens), torch.split(result, counts), strict=True)
        for number, (own, out) in enumerate(parts):
            own = own[:-1, : ragged.lengths[number]]
            pairs, total = own.new_zeros(own.shape[2], own.shape[2]), own.new_zeros(own.shape[2])
            for part in _parts(*own.shape[:2]):
                normed = self.attention.norm(own[part]).flatten(0, 1)
                pairs.addmm_(normed.T, normed)
                total += normed.sum(0)
            count = own.new_full((1,), own.shape[0] * own.shape[1])
            scores = self.attention.scores(pairs.unsqueeze(0), total.unsqueeze(0), count)
            matrix, bias = self.attention.mixing(*scores)
            for part in _parts(len(out) - 1, own.shape[1]):
                out[part] = self._part(own, part, matrix[0], bias[0])
        return result

    def _part(self, own: Tensor, part: tuple[slice, slice], matrix: Tensor, bias: Tensor) -> Tensor:
        """The result for a part of a sequence, for which a rim around it is read."""
        starts = [max(side.start - HALO, 0) for side in part]
        read = own[starts[0] : part[0].stop + HALO, starts[1] : part[1].stop + HALO]
        normed = self.attention.norm(read)
        mixed = torch.addmm(bias, normed.flatten(0, 1), matrix).view(read.shape).add_(read)
        tracks, frames = (np.ones((1, size), bool) for size in read.shape[:2])
        ragged = to_device(RaggedTokens.of(tracks, frames), read.device)
        mixed = self.local(functional.pad(mixed, (0, 0, 0, 0, 0, 1)), ragged)
        inner = [slice(s.start - k, s.stop - k) for s, k in zip(part, starts, strict=True)]
        return self.feed(mixed[inner[0], inner[1]])


def _parts(tracks: int, length: int) -> list[tuple[slice, slice]]:
    sides = [
        [slice(start, min(start + side, size)) for start in range(0, size, side)]
        for side, size in zip(SIDE, (tracks, length), strict=True)
    ]
    return list(product(*sides))
