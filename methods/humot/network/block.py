"""A transformer block after XCiT: attention between channels, local interaction, feed-forward layers."""

from __future__ import annotations

from itertools import product

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from .attention import Attention, Sums
from .feed import Feed
from .local import Local
from .tokens import Lines, cut

LONG = 1 << 14
"""Tokens of a sequence beyond which it is read in parts, where no gradients are wanted."""
SIDE = (32, 64)
"""Lines and frames of a part."""
HALO = 2
"""How far the two convolutions of the local interaction reach."""
Part = tuple[slice, slice]


class Block(nn.Module):
    """Three residual steps, each with its norm before and its layer scale behind it."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        self.attention = Attention(design)
        self.local = Local(design)
        self.feed = Feed(design)

    def forward(self, tokens: Tensor, lines: Lines, kept: int | None = None) -> Tensor:
        """``(lines, frames, width)``; with ``kept``, only so many first lines of each sequence.

        What the other ones would become is then worked out only for statistics over a batch.
        """
        apart = not self.local.gathers
        if apart and not torch.is_grad_enabled() and lines.length * max(lines.counts) > LONG:
            return self._in_parts(tokens, lines, kept)
        chosen = lines.first(kept + HALO) if apart and kept is not None else None
        tokens = self.attention(tokens, lines, chosen)
        lines = lines if chosen is None else chosen[0]
        tokens = self.local(tokens, lines)
        if kept is not None:
            lines, index = lines.first(kept)
            tokens = tokens[index]
        return self.feed(tokens, lines.pieces)

    def _in_parts(self, tokens: Tensor, lines: Lines, kept: int | None) -> Tensor:
        """The same with little memory besides tokens and result."""
        out = lines if kept is None else lines.first(kept)[0]
        result = tokens.new_zeros(out.total, *tokens.shape[1:])
        for number, (own, found) in enumerate(zip(lines.over(tokens), out.over(result), strict=True)):
            own = own[:, : lines.lengths[number]]
            matrix, bias = self.attention.mixing(*self.attention.scores(self._sums(own)))
            for part in _parts(len(found), own.shape[1]):
                found[part] = self._part(own, part, matrix[0], bias[0])
        return result

    def _sums(self, own: Tensor) -> Sums:
        """Of one sequence ``(lines, frames, width)``."""
        lines, length, width = own.shape
        pairs, total = own.new_zeros(width, width), own.new_zeros(width)
        for part in _parts(lines, length):
            normed = self.attention.norm(own[part]).flatten(0, 1)
            pairs.addmm_(normed.T, normed)
            total += normed.sum(0)
        biased = self.attention.qkv.bias is not None
        number = own.new_full((1,), lines * length)
        return Sums(pairs.unsqueeze(0), total.unsqueeze(0) if biased else None, number)

    def _part(self, own: Tensor, part: Part, matrix: Tensor, bias: Tensor) -> Tensor:
        """What becomes of a part of a sequence, for which a rim around it is read."""
        pairs = list(zip(part, own.shape[:2], strict=True))
        rim = [slice(max(side.start - HALO, 0), min(side.stop + HALO, size)) for side, size in pairs]
        read = own[rim[0], rim[1]]
        normed = self.attention.norm(read)
        mixed = torch.addmm(bias, normed.flatten(0, 1), matrix).view(read.shape).add_(read)
        lines = Lines([len(read)], read.shape[1], None, read.device)
        mixed = self.local(functional.pad(mixed, (0, 0, 0, 0, 0, 1)), lines)
        inner = [
            slice(side.start - each.start, side.stop - each.start)
            for side, each in zip(part, rim, strict=True)
        ]
        kept = mixed[inner[0], inner[1]].contiguous()
        return self.feed(kept, cut(slice(0, kept.shape[0] * kept.shape[1])))


def _parts(lines: int, length: int) -> list[Part]:
    sides = [
        [slice(start, min(start + side, size)) for start in range(0, size, side)]
        for side, size in zip(SIDE, (lines, length), strict=True)
    ]
    return list(product(*sides))
