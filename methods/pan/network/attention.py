"""Attention within body parts (section 4.2): tokens gather what the slots of their parts say.

Rows are the tokens of the parts, then slots; rows that see the same rows are computed together.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from .plan import Group, Parts


class Attention(nn.Module):
    """One layer of attention.

    With a ``feedforward`` width it is a transformer's, norms behind each block: output projection, a
    rectifying block (GELU), residuals, dropout. Else it is equations 4 and 5 and nothing more.
    """

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.heads, self.dropout = design.heads, design.dropout
        self.qkv = nn.Linear(width, 3 * width)
        nn.init.xavier_uniform_(self.qkv.weight)
        nn.init.zeros_(self.qkv.bias)
        self.block = Block(design) if design.feedforward else None

    def forward(self, rows: Tensor, groups: Sequence[Group]) -> Tensor:
        """``(frames, queries, width)`` from ``(frames, rows, width)``; groups: of the first rows."""
        queries, keys, values = self._projected(rows)
        found = []
        for group in groups:
            weights = self._weights(queries, keys, group)
            weights = functional.dropout(weights, self.dropout, self.training)
            seen = values[:, list(group.keys)].transpose(1, 2)
            found.append((weights @ seen).transpose(1, 2).flatten(2))
        result = torch.cat(found, 1)
        if self.block is None:
            return result
        return self.block(rows[:, : result.shape[1]], result)

    def weights(self, rows: Tensor, group: Group) -> Tensor:
        """How much each query heeds each key ``(frames, queries, keys)``: the mean over heads."""
        queries, keys, _ = self._projected(rows)
        return self._weights(queries, keys, group).mean(1)

    def _projected(self, rows: Tensor) -> tuple[Tensor, ...]:
        """Three of ``(frames, rows, heads, width // heads)``."""
        return self.qkv(rows).unflatten(-1, (3, self.heads, -1)).unbind(2)

    def _weights(self, queries: Tensor, keys: Tensor, group: Group) -> Tensor:
        asking = queries[:, group.queries].transpose(1, 2)
        seen = keys[:, list(group.keys)].permute(0, 2, 3, 1)
        return ((asking @ seen) * asking.shape[-1] ** -0.5).softmax(-1)


class Block(nn.Module):
    """What stands behind the attention of a transformer."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.dropout = design.dropout
        self.out = nn.Linear(width, width)
        nn.init.zeros_(self.out.bias)
        self.norms = nn.ModuleList([nn.LayerNorm(width), nn.LayerNorm(width)])
        self.feed = nn.ModuleList(
            [nn.Linear(width, design.feedforward), nn.Linear(design.feedforward, width)]
        )

    def forward(self, rows: Tensor, found: Tensor) -> Tensor:
        """rows: ``(..., width)`` that asked. found: what they found."""
        rows = self.norms[0](rows + self._dropped(self.out(found)))
        inner = self._dropped(functional.gelu(self.feed[0](rows)))
        return self.norms[1](rows + self._dropped(self.feed[1](inner)))

    def _dropped(self, values: Tensor) -> Tensor:
        return functional.dropout(values, self.dropout, self.training)


class Mean(nn.Module):
    """In the place of attention where that is left out: a linear layer, rectified, and means of parts.

    parts: positions of the slots of each.
    """

    def __init__(self, design: Design, parts: Parts) -> None:
        super().__init__()
        self.leak, self.parts = design.leak, parts
        self.linear = nn.Linear(design.width, design.width)

    def forward(self, slots: Tensor) -> tuple[Tensor, Tensor]:
        """``(frames, parts, width)`` and the new slots, from slots ``(frames, slots, width)``."""
        slots = functional.leaky_relu(self.linear(slots), self.leak)
        means = [slots[:, list(part)].mean(1) for part in self.parts]
        return torch.stack(means, 1), slots
