"""Attention within body parts (section 4.2): tokens gather what the slots of their parts say.

Everything here is one frame's affair. Rows, ``(frames, rows, width)``, are the tokens of the parts,
then slots.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from .core import Blocks
from .dropout import Noise, dropped
from .plan import Parts
from .wide import wide


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

    def forward(self, rows: Tensor, blocks: Blocks, noise: Noise | None) -> Tensor:
        """``(frames, asking, width)`` from ``(frames, rows, width)``; blocks: who sees whom."""
        asking = rows[:, : blocks.asking]
        found = blocks(*self._projected(asking, rows), noise)
        return found if self.block is None else self.block(asking, found, noise)

    def weights(self, rows: Tensor, blocks: Blocks) -> Tensor:
        """How much queries heed keys ``(frames, groups, queries, keys)``, see ``Blocks.weights``."""
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
    """What stands behind the attention of a transformer.

    A projection and a block that is wide inside (GELU), each with dropout, residual and norm behind it.
    """

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.out = nn.Linear(width, width)
        nn.init.zeros_(self.out.bias)
        self.norms = nn.ModuleList([nn.LayerNorm(width), nn.LayerNorm(width)])
        self.feed = nn.ModuleList(
            [nn.Linear(width, design.feedforward), nn.Linear(design.feedforward, width)]
        )

    def forward(self, rows: Tensor, found: Tensor, noise: Noise | None) -> Tensor:
        """rows: ``(frames, asking, width)`` that asked. found: what they found."""
        first, second = self.norms
        rows = first(rows + dropped(self.out(found), noise))
        fed = wide(rows.flatten(0, 1), self.feed, "gelu", noise).view(rows.shape)
        return second(rows + dropped(fed, noise))


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
        return torch.stack([slots[:, list(part)].mean(1) for part in self.parts], 1), slots
