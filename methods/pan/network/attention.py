"""Attention within body parts (section 4.2), frame by frame: tokens gather from the edges of their parts.

Rows, ``(frames, rows, width)``, are the tokens of the parts, then edges. Groups of rows that see the same
rows go through small matrices together, padded to the largest of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from .groups import Group, Parts
from .layers import DropoutMask, dropped, mlp


class Attention(nn.Module):
    """One layer of attention (eq. 4 and 5).

    With a ``feedforward`` width it is a transformer's, see ``Block``; else it is the equations and no more.
    """

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.qkv = nn.Linear(width, 3 * width)
        nn.init.xavier_uniform_(self.qkv.weight)
        nn.init.zeros_(self.qkv.bias)
        self.block = Block(design) if design.feedforward else None

    def forward(self, rows: Tensor, blocks: Blocks, mask: DropoutMask | None) -> Tensor:
        """``(frames, queries, width)`` from ``(frames, rows, width)``; blocks: the rows that each sees."""
        asking = rows[:, : blocks.asking]
        found = blocks(*self._projected(asking, rows), mask)
        return found if self.block is None else self.block(asking, found, mask)

    def weights(self, rows: Tensor, blocks: Blocks) -> Tensor:
        """Attention weights ``(frames, groups, queries, keys)``, see ``Blocks.weights``."""
        return blocks.weights(*self._projected(rows[:, : blocks.asking], rows))

    def _projected(self, asking: Tensor, rows: Tensor) -> tuple[Tensor, Tensor]:
        """Queries, and keys with values."""
        width = rows.shape[2]
        weight, bias = self.qkv.weight, self.qkv.bias
        return (
            functional.linear(asking, weight[:width], bias[:width]),
            functional.linear(rows, weight[width:], bias[width:]),
        )


class Block(nn.Module):
    """The rest of a transformer's layer: projection and MLP, each with dropout, residual and norm."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.out = nn.Linear(width, width)
        nn.init.zeros_(self.out.bias)
        self.norms = nn.ModuleList([nn.LayerNorm(width), nn.LayerNorm(width)])
        self.feed = nn.ModuleList(
            [nn.Linear(width, design.feedforward), nn.Linear(design.feedforward, width)]
        )

    def forward(self, rows: Tensor, found: Tensor, mask: DropoutMask | None) -> Tensor:
        """rows: ``(frames, queries, width)`` before attention. found: behind it."""
        first, second = self.norms
        rows = first(rows + dropped(self.out(found), mask))
        fed = mlp(rows.flatten(0, 1), self.feed, "gelu", mask).view(rows.shape)
        return second(rows + dropped(fed, mask))


class Mean(nn.Module):
    """A linear layer, rectified, and means of parts, in the place of attention (Table 5).

    parts: indices of the edges of each.
    """

    def __init__(self, design: Design, parts: Parts) -> None:
        super().__init__()
        self.leak, self.parts = design.leak, parts
        self.linear = nn.Linear(design.width, design.width)

    def forward(self, edges: Tensor) -> tuple[Tensor, Tensor]:
        """``(frames, parts, width)`` and the new edges, from edges ``(frames, edges, width)``."""
        edges = functional.leaky_relu(self.linear(edges), self.leak)
        return torch.stack([edges[:, list(part)].mean(1) for part in self.parts], 1), edges


class Blocks(nn.Module):
    """Attention among some rows, as blocks of groups that see the same rows.

    groups: of about one size; together they see every row. shared: one more, that sees the last rows.
    The queries of all are the first rows. heads: of the layer.
    """

    order: Tensor

    def __init__(self, groups: Sequence[Group], shared: Group | None, heads: int) -> None:
        super().__init__()
        self.padded = Padded(groups, heads)
        self.shared = None if shared is None else Padded([shared], heads)
        size = max(len(group.queries) for group in groups)
        place = {
            row: number * size + k
            for number, group in enumerate(groups)
            for k, row in enumerate(group.queries)
        }
        if shared is not None:
            place |= {row: len(groups) * size + k for k, row in enumerate(shared.queries)}
        self.asking = len(place)
        order = torch.tensor([place[row] for row in range(self.asking)])
        self.register_buffer("order", order, persistent=False)

    def forward(self, queries: Tensor, pairs: Tensor, mask: DropoutMask | None) -> Tensor:
        """``(frames, queries, width)``: what each query gathers from the rows that it sees.

        queries: ``(frames, queries, width)``. pairs: ``(frames, rows, 2 * width)``, keys and values.
        """
        found = self.padded(queries, pairs, mask)
        if self.shared is not None:
            found = torch.cat([found, self.shared(queries, pairs, mask)], 1)
        return found.index_select(1, self.order)

    @torch.no_grad()
    def weights(self, queries: Tensor, pairs: Tensor) -> Tensor:
        """Attention weights ``(frames, groups, queries, keys)`` of all but the shared group, the mean over
        heads."""
        return self.padded.weighted(queries, pairs)[0].mean(2)


class Padded(nn.Module):
    """Attention of groups, padded to one size.

    queries, keys: ``(groups * size,)`` rows that are read, group by group; any row at padding.
    hidden: ``(groups, 1, queries, keys)``, -inf where a query does not see a key. real: 0 at padded
    queries, else 1.
    """

    queries: Tensor
    keys: Tensor
    hidden: Tensor
    real: Tensor

    def __init__(self, groups: Sequence[Group], heads: int) -> None:
        super().__init__()
        self.heads = heads
        asking = max(len(group.queries) for group in groups)
        seen = max(len(group.keys) for group in groups)
        hidden = torch.full((len(groups), 1, asking, seen), -torch.inf)
        real = torch.zeros(len(groups), 1, asking, 1)
        for number, group in enumerate(groups):
            count = len(group.queries)
            hidden[number, 0, :count, : len(group.keys)][torch.tensor(group.sees)] = 0.0
            hidden[number, 0, count:] = 0.0  # a softmax of nothing is not a number
            real[number, 0, :count] = 1.0
        buffers = {
            "queries": torch.tensor([row for group in groups for row in _filled(group.queries, asking)]),
            "keys": torch.tensor([row for group in groups for row in _filled(group.keys, seen)]),
            "hidden": hidden,
            "real": real,
        }
        for name, values in buffers.items():
            self.register_buffer(name, values, persistent=False)

    def forward(self, queries: Tensor, pairs: Tensor, mask: DropoutMask | None) -> Tensor:
        """``(frames, groups * queries, width)``, zero at padding.

        queries: ``(frames, rows, width)``. pairs: ``(frames, rows, 2 * width)``, keys and values.
        """
        weights, values = self.weighted(queries, pairs)
        shape = weights.shape[:-1]
        weights = dropped(weights.flatten(0, 2), mask)
        if weights.shape[1] == 1:  # products of small matrices take longer where there is one query
            found = (weights.transpose(1, 2) * values).sum(1)
        else:
            found = torch.bmm(weights, values)
        return found.view(*shape, -1).transpose(2, 3).reshape(len(queries), -1, queries.shape[2])

    def weighted(self, queries: Tensor, pairs: Tensor) -> tuple[Tensor, Tensor]:
        """Attention weights ``(frames, groups, heads, queries, keys)``, and values
        ``(frames * groups * heads, keys, size)``."""
        frames, _, width = queries.shape
        groups, _, asking, seen = self.hidden.shape
        size = width // self.heads
        queries = queries.index_select(1, self.queries).view(frames, groups, asking, self.heads, size)
        pairs = pairs.index_select(1, self.keys).view(frames, groups, seen, 2, self.heads, size)
        keys, values = pairs.unbind(3)
        keys = keys.permute(0, 1, 3, 4, 2).reshape(-1, size, seen)
        values = values.transpose(2, 3).reshape(-1, seen, size)
        if asking == 1:
            scores = (keys * queries.reshape(-1, size, 1)).sum(1)
        else:
            scores = torch.bmm(queries.transpose(2, 3).reshape(-1, asking, size), keys)
        scores = torch.add(self.hidden, scores.view(frames, groups, -1, asking, seen), alpha=size**-0.5)
        # Torch's softmax takes more than twice as long where so few numbers are summed.
        shares = (scores - scores.detach().amax(-1, keepdim=True)).exp_()
        return shares * (self.real / shares.sum(-1, keepdim=True)), values


def _filled(rows: Sequence[int], count: int) -> list[int]:
    return [*rows, *[rows[0]] * (count - len(rows))]
