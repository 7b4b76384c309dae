"""PAN's skeleton encoder: a body's bones to a code for each part (section 5.2, eq. 7)."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from ..layout import Layout
from .plan import body_parts
from .ragged import PartLinear


class SkeletonEncoder(nn.Module):
    """Three linear layers for each part, from the bones of its slots.

    The root's slot has no bone, and no weights that would read it. Where the body is one part, the layers
    are as wide as those of all parts together.
    """

    chosen: Tensor

    def __init__(self, layout: Layout, design: Design) -> None:
        super().__init__()
        self.shape = (len(layout.parts), design.width)
        self.leak, self.bent, self.share = design.leak, design.skeleton_bent, design.skeleton_share
        parts = [part[:-1] for part in body_parts(layout, design)]
        count, times = len(parts), 1 if design.by_part else len(layout.parts)
        hidden = times * design.skeleton
        chosen = torch.tensor([slot for part in parts for slot in part])
        self.register_buffer("chosen", chosen, persistent=False)
        self.layers = nn.ModuleList(
            [
                PartLinear([3 * len(part) for part in parts], hidden),
                PartLinear([hidden] * count, hidden),
                PartLinear([hidden] * count, times * design.width),
            ]
        )

    def forward(self, bones: Tensor) -> Tensor:
        """``(rows, parts, width)``, multiplied by its share, from ``(rows, slots + 1, 3)``."""
        values = bones.index_select(1, self.chosen)
        for number, layer in enumerate(self.layers):
            values = layer(values.flatten(1))
            if self.bent or number < len(self.layers) - 1:
                values = functional.leaky_relu(values, self.leak)
        return values.reshape(-1, *self.shape) * self.share
