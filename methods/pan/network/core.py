"""Scores, softmax and sums of attention within groups of rows, for many frames at once.

Groups go through small matrices together, padded to the largest of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from .dropout import Noise
from .gather import Table
from .plan import Group


class Blocks(nn.Module):
    """Who attends to whom among some rows.

    groups: of about one size; together they see every row. shared: one more, that sees the last rows.
    The queries of all are the first rows. heads: of the layer.
    """

    def __init__(self, groups: Sequence[Group], shared: Group | None, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.padded = Padded(groups)
        self.shared = None if shared is None else Padded([shared])
        blocks = [self.padded] if self.shared is None else [self.padded, self.shared]
        every = [*groups] if shared is None else [*groups, shared]
        self.asking = sum(len(group.queries) for group in every)
        self.rows = 1 + max(key for group in every for key in group.keys)
        self.start = self.rows if shared is None else shared.keys[0]
        asked = [_placed(block.queries, heads, 1, 0) for block in blocks]
        seen = [_placed(self.padded.keys, heads, 2, which) for which in range(2)]
        places = {row: place for place, row in enumerate(chain(*asked))}
        self.asked = Table(asked, self.asking * heads)
        self.seen = Table(seen, self.rows * 2 * heads)
        found = [places[row] for row in range(self.asking * heads)]
        self.found = Table([found], sum(map(len, asked)))

    def forward(self, queries: Tensor, pairs: Tensor, noise: Noise | None) -> Tensor:
        """``(frames, asking, width)``: what each query gathers from the rows that it sees.

        queries: ``(frames, asking, width)``. pairs: ``(frames, rows, 2 * width)``, keys and values.
        """
        frames, _, width = queries.shape
        size = width // self.heads
        asked = self.asked(queries.reshape(frames, -1, size))
        seen = self.seen(pairs.reshape(frames, -1, size))
        found = self.padded(asked[0], *seen, noise)
        if self.shared is not None:
            whole = pairs.view(frames, self.rows, 2, self.heads, size)[:, self.start :]
            seen = whole.permute(2, 0, 3, 1, 4).flatten(2, 3).unbind(0)
            found = torch.cat([found, self.shared(asked[1], *seen, noise)], 1)
        return self.found(found)[0].view(frames, -1, width)

    @torch.no_grad()
    def weights(self, queries: Tensor, pairs: Tensor) -> Tensor:
        """How much queries of groups heed keys ``(frames, groups, queries, keys)``, the mean over heads.

        Without gradients, and without the shared group.
        """
        frames, _, width = queries.shape
        asked = self.asked(queries.reshape(frames, -1, width // self.heads))
        seen = self.seen(pairs.reshape(frames, -1, width // self.heads))
        return _weigh(asked[0], seen[0], self.padded.hidden, self.padded.real).mean(2)


class Padded(nn.Module):
    """Groups of one size; -1 where there is nothing.

    hidden: ``(groups, 1, queries, keys)``, -inf where a query does not see a key. real: 0 where there is
    no query, else 1.
    """

    hidden: Tensor
    real: Tensor

    def __init__(self, groups: Sequence[Group]) -> None:
        super().__init__()
        asking = max(len(group.queries) for group in groups)
        seen = max(len(group.keys) for group in groups)
        self.queries = [_filled(group.queries, asking) for group in groups]
        self.keys = [_filled(group.keys, seen) for group in groups]
        hidden = torch.full((len(groups), 1, asking, seen), -torch.inf)
        real = torch.zeros(len(groups), 1, asking, 1)
        for number, group in enumerate(groups):
            queries, keys = len(group.queries), len(group.keys)
            hidden[number, 0, :queries, :keys][torch.tensor(group.sees)] = 0.0
            hidden[number, 0, queries:] = 0.0  # a softmax of nothing is not a number
            real[number, 0, :queries] = 1.0
        self.register_buffer("hidden", hidden, persistent=False)
        self.register_buffer("real", real, persistent=False)

    def forward(self, queries: Tensor, keys: Tensor, values: Tensor, noise: Noise | None) -> Tensor:
        """All ``(frames, groups * heads * (queries or keys), size)``; queries that are none find zeros."""
        return _attend(queries, keys, values, self.hidden, self.real, noise)


def _placed(rows: Sequence[Sequence[int]], heads: int, times: int, which: int) -> list[int]:
    """Where heads of rows lie, group by group, head by head; rows hold ``times`` times the heads."""
    return [
        (row * times + which) * heads + head if row >= 0 else -1
        for group in rows
        for head in range(heads)
        for row in group
    ]


def _filled(rows: Sequence[int], count: int) -> list[int]:
    return [*rows, *[-1] * (count - len(rows))]


def _weigh(queries: Tensor, keys: Tensor, hidden: Tensor, real: Tensor) -> Tensor:
    """Softmax of products, ``(frames, groups, heads, queries, keys)``.

    Torch's own softmax is slow where so few numbers are summed, and its products are where the second
    matrices are transposed views.
    """
    frames, _, size = queries.shape
    groups, _, asking, seen = hidden.shape
    scores = _scores(queries.view(-1, asking, size), keys.view(-1, seen, size))
    scores = scores.view(frames, groups, -1, asking, seen)
    torch.add(hidden, scores, alpha=size**-0.5, out=scores)
    scores -= scores.amax(-1, keepdim=True)
    scores.exp_()
    scores *= real / scores.sum(-1, keepdim=True)
    return scores


def _scores(queries: Tensor, keys: Tensor) -> Tensor:
    """``(matrices, queries, keys)``; where there is one query, products of small matrices take longer."""
    if queries.shape[1] == 1:
        return (keys * queries).sum(2).unsqueeze(1)
    return torch.bmm(queries, keys.transpose(1, 2).contiguous())


def _sums(weights: Tensor, keys: Tensor) -> Tensor:
    """Of keys, for each query: ``(matrices, queries, size)``."""
    if weights.shape[1] == 1:
        return (weights.transpose(1, 2) * keys).sum(1, keepdim=True)
    return torch.bmm(weights, keys)


def _shares(weights: Tensor, queries: Tensor) -> Tensor:
    """Sums of queries, for each key: ``(matrices, keys, size)``."""
    if weights.shape[1] == 1:
        return weights.transpose(1, 2) * queries
    return torch.bmm(weights.transpose(1, 2), queries)


class _Attend(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        queries: Tensor,
        keys: Tensor,
        values: Tensor,
        hidden: Tensor,
        real: Tensor,
        noise: Noise | None,
    ) -> Tensor:
        weights = _weigh(queries, keys, hidden, real).flatten(0, 2)
        ctx.noise, ctx.drawn = noise, None if noise is None else noise.bytes(*weights.shape)
        ctx.save_for_backward(queries, keys, values, weights)
        kept = weights if noise is None else weights * noise.kept(ctx.drawn, weights)
        found = _sums(kept, values.view(len(weights), weights.shape[2], -1))
        return found.view(queries.shape)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        queries, keys, values, weights = ctx.saved_tensors
        matrices, asking, seen = weights.shape
        pull = pull.reshape(matrices, asking, -1)
        kept = weights
        if ctx.noise is not None:
            kept = weights * ctx.noise.kept(ctx.drawn, weights)
        to_values = _shares(kept, pull)
        inner = _scores(pull, values.view(matrices, seen, -1)).mul_(kept)
        inner = inner.addcmul_(weights, inner.sum(2, keepdim=True), value=-1.0)
        inner *= pull.shape[2] ** -0.5
        to_queries = _sums(inner, keys.view(matrices, seen, -1))
        to_keys = _shares(inner, queries.view(matrices, asking, -1))
        found = zip((to_queries, to_keys, to_values), (queries, keys, values), strict=True)
        return (*(each.view(like.shape) for each, like in found), None, None, None)


_attend: Callable[..., Tensor] = _Attend.apply
