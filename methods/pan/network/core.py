"""Scores, softmax and sums of attention within groups of rows, for many frames at once.

Groups of about one size go through small matrices together, padded to the largest of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from .dropout import Noise
from .gather import Table
from .plan import Group

Block = Sequence[Group]
"""Groups that are padded to the largest."""


class Blocks(nn.Module):
    """Groups of attention among some rows.

    Every row is seen by some query, and the queries of all blocks are the first rows. heads: of the layer.
    """

    def __init__(self, blocks: Sequence[Block], heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.asking = sum(len(group.queries) for block in blocks for group in block)
        self.blocks = nn.ModuleList(Padded(block) for block in blocks)
        asked, seen, found = [], [], [0] * (self.asking * heads)
        for each in self.blocks:
            asked.append(each.placed(each.queries, heads, 1, 0))
            seen.extend(each.placed(each.keys, heads, 2, which) for which in range(2))
        place = 0
        for chunk in (chunk for piece in asked for chunk in piece):
            if chunk >= 0:
                found[chunk] = place
            place += 1
        rows = 1 + max(key for block in blocks for group in block for key in group.keys)
        self.asked = Table(asked, self.asking * heads)
        self.seen = Table(seen, rows * 2 * heads)
        self.found = Table([found], place)

    def forward(self, queries: Tensor, pairs: Tensor, noise: Noise | None) -> Tensor:
        """``(frames, asking, width)``: what each query gathers from the rows that it sees.

        queries: ``(frames, asking, width)``. pairs: ``(frames, rows, 2 * width)``, keys and values.
        """
        frames, _, width = queries.shape
        size = width // self.heads
        asked = self.asked(queries.reshape(frames, -1, size))
        seen = self.seen(pairs.reshape(frames, -1, size))
        gathered = [
            _attend(own, keys, values, each.hidden, each.real, self.heads, noise).view(frames, -1, size)
            for each, own, keys, values in zip(self.blocks, asked, seen[::2], seen[1::2], strict=True)
        ]
        together = torch.cat(gathered, 1) if len(gathered) > 1 else gathered[0]
        return self.found(together)[0].view(frames, -1, width)

    @torch.no_grad()
    def weights(self, queries: Tensor, pairs: Tensor) -> Iterator[Tensor]:
        """Of each block how much queries heed keys ``(frames, groups, queries, keys)``, mean over heads.

        Without gradients.
        """
        frames, _, width = queries.shape
        asked = self.asked(queries.reshape(frames, -1, width // self.heads))
        seen = self.seen(pairs.reshape(frames, -1, width // self.heads))
        for each, own, keys in zip(self.blocks, asked, seen[::2], strict=True):
            yield _weigh(own, keys, each.hidden, each.real, self.heads).mean(2)


class Padded(nn.Module):
    """A block; -1 where there is nothing.

    hidden: ``(groups, 1, queries, keys)``, -inf where a query does not see a key. real: 0 where there is
    no query, else 1.
    """

    hidden: Tensor
    real: Tensor

    def __init__(self, block: Block) -> None:
        super().__init__()
        asking = max(len(group.queries) for group in block)
        seen = max(len(group.keys) for group in block)
        self.queries = [_filled(group.queries, asking) for group in block]
        self.keys = [_filled(group.keys, seen) for group in block]
        hidden = torch.full((len(block), 1, asking, seen), -torch.inf)
        real = torch.zeros(len(block), 1, asking, 1)
        for number, group in enumerate(block):
            queries, keys = len(group.queries), len(group.keys)
            hidden[number, 0, :queries, :keys][torch.tensor(group.sees)] = 0.0
            hidden[number, 0, queries:] = 0.0  # a softmax of nothing is not a number
            real[number, 0, :queries] = 1.0
        self.register_buffer("hidden", hidden, persistent=False)
        self.register_buffer("real", real, persistent=False)

    @staticmethod
    def placed(rows: Sequence[Sequence[int]], heads: int, times: int, which: int) -> list[int]:
        """Where heads of rows lie, group by group, head by head; rows hold ``times`` times the heads."""
        return [
            (row * times + which) * heads + head if row >= 0 else -1
            for group in rows
            for head in range(heads)
            for row in group
        ]


def _filled(rows: Sequence[int], count: int) -> list[int]:
    return [*rows, *[-1] * (count - len(rows))]


def _weigh(queries: Tensor, keys: Tensor, hidden: Tensor, real: Tensor, heads: int) -> Tensor:
    """Softmax of products, ``(frames, groups, heads, queries, keys)``.

    Torch's own softmax is slow where so few numbers are summed, and its products are where the second
    matrices are transposed views.
    """
    frames, _, size = queries.shape
    groups, _, asking, seen = hidden.shape
    turned = keys.view(-1, seen, size).transpose(1, 2).contiguous()
    flat = torch.bmm(queries.view(-1, asking, size), turned)
    scores = flat.view(frames, groups, heads, asking, seen)
    torch.add(hidden, scores, alpha=size**-0.5, out=scores)
    scores -= scores.amax(-1, keepdim=True)
    scores.exp_()
    scores *= real / scores.sum(-1, keepdim=True)
    return scores


class _Attend(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        queries: Tensor,
        keys: Tensor,
        values: Tensor,
        hidden: Tensor,
        real: Tensor,
        heads: int,
        noise: Noise | None,
    ) -> Tensor:
        weights = _weigh(queries, keys, hidden, real, heads).flatten(0, 2)
        ctx.noise, ctx.drawn = noise, None if noise is None else noise.bytes(*weights.shape)
        ctx.save_for_backward(queries, keys, values, weights)
        kept = weights if noise is None else weights * noise.kept(ctx.drawn, weights)
        return torch.bmm(kept, values.view(*_shape(weights, 2), -1))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        queries, keys, values, weights = ctx.saved_tensors
        asking, seen = _shape(weights, 1), _shape(weights, 2)
        pull = pull.reshape(*asking, -1)
        kept, factor = weights, None
        if ctx.noise is not None:
            factor = ctx.noise.kept(ctx.drawn, weights)
            kept = weights * factor
        to_values = torch.bmm(kept.transpose(1, 2), pull)
        inner = torch.bmm(pull, values.view(*seen, -1).transpose(1, 2).contiguous())
        inner *= kept
        inner = torch.addcmul(inner, weights, inner.sum(2, keepdim=True), value=-1.0)
        inner *= pull.shape[2] ** -0.5
        to_queries = torch.bmm(inner, keys.view(*seen, -1))
        to_keys = torch.bmm(inner.transpose(1, 2), queries.view(*asking, -1))
        return (
            to_queries.view(queries.shape),
            to_keys.view(keys.shape),
            to_values.view(values.shape),
            None,
            None,
            None,
            None,
        )


_attend: Callable[..., Tensor] = _Attend.apply


def _shape(weights: Tensor, axis: int) -> tuple[int, int]:
    return weights.shape[0], weights.shape[axis]
