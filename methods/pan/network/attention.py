"""Attention within body parts (section 4.2), frame by frame: tokens gather from the edges of their parts.

Rows, ``(frames, rows, width)``, are the tokens of the parts, then edges.
"""

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..settings import Design
from .layers import DropoutMask, dropped, mlp


class Attention(nn.Module):
    """One layer of attention (eq. 4 and 5).

    With a ``feedforward`` width it is a transformer's, see ``Block``; else it is the equations and no more.
    """

    def __init__(self, design: Design) -> None:
        super().__init__()
        self.heads, width = design.heads, design.width
        self.qkv = nn.Linear(width, 3 * width)
        nn.init.xavier_uniform_(self.qkv.weight)
        nn.init.zeros_(self.qkv.bias)
        self.block = Block(design) if design.feedforward else None

    def forward(self, rows: Tensor, hidden: Tensor, mask: DropoutMask | None) -> Tensor:
        """``(frames, queries, width)`` from ``(frames, rows, width)``.

        hidden: ``(queries, rows)``, -inf where one of the first rows does not see a row, else 0.
        """
        queries, keys, values = self._projected(rows, len(hidden))
        if mask is None:
            attended = functional.scaled_dot_product_attention(queries, keys, values, hidden)
        else:
            attended = dropped(_shares(queries, keys, hidden), mask) @ values
        attended = attended.transpose(1, 2).flatten(2)
        return attended if self.block is None else self.block(rows[:, : len(hidden)], attended, mask)

    @torch.no_grad()
    def weights(self, rows: Tensor, hidden: Tensor) -> Tensor:
        """Attention weights ``(frames, heads, queries, rows)``."""
        queries, keys, _ = self._projected(rows, len(hidden))
        return _shares(queries, keys, hidden)

    def _projected(self, rows: Tensor, asking: int) -> list[Tensor]:
        """Queries of the first rows, keys and values, each ``(frames, heads, rows, size)``."""
        weights, biases = self.qkv.weight.chunk(3), self.qkv.bias.chunk(3)
        return [
            functional.linear(each, *both).view(*each.shape[:2], self.heads, -1).transpose(1, 2)
            for each, *both in zip((rows[:, :asking], rows, rows), weights, biases, strict=True)
        ]


def _shares(queries: Tensor, keys: Tensor, hidden: Tensor) -> Tensor:
    scores = queries @ keys.transpose(2, 3)
    return torch.add(hidden, scores, alpha=queries.shape[-1] ** -0.5).softmax(-1)


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

    def forward(self, rows: Tensor, attended: Tensor, mask: DropoutMask | None) -> Tensor:
        """rows: ``(frames, queries, width)`` before attention. attended: behind it."""
        first, second = self.norms
        rows = first(rows + dropped(self.out(attended), mask))
        fed = mlp(rows.flatten(0, 1), self.feed, "gelu", mask).view(rows.shape)
        return second(rows + dropped(fed, mask))


class Mean(nn.Module):
    """A linear layer, rectified, and means of parts, in the place of attention (Table 5).

    parts: indices of the edges of each.
    """

    def __init__(self, design: Design, parts: Sequence[Sequence[int]]) -> None:
        super().__init__()
        self.leak, self.parts = design.leak, parts
        self.linear = nn.Linear(design.width, design.width)

    def forward(self, edges: Tensor) -> tuple[Tensor, Tensor]:
        """``(frames, parts, width)`` and the new edges, from edges ``(frames, edges, width)``."""
        edges = functional.leaky_relu(self.linear(edges), self.leak)
        return torch.stack([edges[:, list(part)].mean(1) for part in self.parts], 1), edges
