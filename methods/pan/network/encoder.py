"""PAN's motion encoder: slots to codes of body parts, at a quarter of the frames (sections 4 and 5.1)."""

from __future__ import annotations

import math
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from ..layout import Layout
from .attention import Attention, Mean
from .plan import Parts, attending, body_parts, convolved_parts
from .ragged import PartConvolution

BASIS = 10_000.0


class Encoder(nn.Module):
    """Embedding of slots, attention within parts, and two convolutions over time of stride 2.

    What the paper leaves open: slots are counted from 0 in eq. 2; padding is by reflection; between two
    interleaved blocks the convolution's output is the part's new token, and slots are averaged over two
    frames. Without attention, a part is the mean of its slots, to which the token that came from a
    convolution is added. Where the body is one part, the first convolution of two widens the token to the
    size of all parts' codes; if a layer of attention follows, the second one does.
    """

    raw: PartConvolution
    slots: Tensor
    code: Tensor
    raw_slots: Tensor

    def __init__(self, layout: Layout, design: Design) -> None:
        super().__init__()
        self.design, self.width = design, layout.slots + 1
        self.early = 1 if design.interleaved else design.layers
        self.parts = len(layout.parts)
        parts = body_parts(layout, design)
        self.rows = attending(parts, design.mutual)
        self.register_buffer("slots", torch.tensor(self.rows.slots), persistent=False)
        self.register_buffer("code", positions(self.rows.slots, design.width), persistent=False)
        sizes = (4, *design.embedding, design.width)
        self.embedding = nn.ModuleList(nn.Linear(*each) for each in pairwise(sizes))
        if design.attention:
            self.tokens = nn.Parameter(0.1 * torch.randn(len(parts), design.width))
            self.layers = nn.ModuleList(Attention(design) for _ in range(design.layers))
        else:
            placed = tuple(tuple(self.rows.slots.index(slot) for slot in part) for part in parts)
            self.layers = nn.ModuleList(Mean(design, placed) for _ in range(design.layers))
        inner, outer = self._channels()
        self.convolutions = nn.ModuleList(
            nn.Conv1d(read, out, design.kernel, stride=2, groups=len(parts)) for read, out in (inner, outer)
        )
        if design.raw:
            self._add_raw(convolved_parts(layout, design), inner[1])

    def forward(self, motion: Tensor) -> Tensor:
        """``(rows, frames // 4, parts, width)`` from ``(rows, frames, slots + 1, 4)``."""
        frames = motion.shape[1]
        rows = self._dropped(self._embedded(motion)).flatten(0, 1)
        tokens, slots = self._attended(None, rows, 0, self.early)
        hidden = self._convolved(tokens, frames, 0, motion)
        if self.early < len(self.layers):
            slots = slots.view(-1, 2, *slots.shape[1:]).mean(1)
            tokens = hidden.transpose(1, 2).reshape(len(slots), -1, slots.shape[-1])
            tokens, _ = self._attended(tokens, slots, self.early, len(self.layers))
            hidden = tokens.view(len(motion), frames // 2, -1).transpose(1, 2)
        hidden = self._rectified(self.convolutions[1](self._padded(hidden)))
        return hidden.transpose(1, 2).reshape(len(motion), -1, self.parts, self.design.width)

    def attention(self, motion: Tensor) -> Tensor:
        """How much each part's token heeds each slot in the first layer, the mean over heads.

        ``(rows, frames, parts, slots + 1)`` from ``(rows, frames, slots + 1, 4)``; without dropout. What a
        token leaves for itself is not in it, so that a part's weights add up to less than 1. Where the body
        is one part there is one. Raises ValueError where the encoder has no attention.
        """
        first = self.layers[0]
        if not isinstance(first, Attention):
            raise ValueError("this encoder was built without attention: there are no weights to show")
        slots = self._embedded(motion).flatten(0, 1)
        rows = torch.cat([self.tokens.expand(len(slots), -1, -1), slots], 1)
        result = motion.new_zeros(len(slots), len(self.rows.tokens), self.width)
        for token, group in enumerate(self.rows.tokens):
            seen = [self.rows.slots[key - len(self.rows.tokens)] for key in group.keys[1:]]
            result[:, token, seen] = first.weights(rows, group)[:, 0, 1:]
        return result.view(*motion.shape[:2], *result.shape[1:])

    def _embedded(self, motion: Tensor) -> Tensor:
        """``(rows, frames, slots, width)`` of the slots that are rows of attention (eq. 1 to 3)."""
        values = motion.index_select(2, self.slots)
        for layer in self.embedding[:-1]:
            values = functional.relu(layer(values))
        values = self.embedding[-1](values)
        return (
            values * math.sqrt(values.shape[-1]) + self.code if self.design.scaled else values + self.code
        )

    def _attended(
        self, tokens: Tensor | None, slots: Tensor, start: int, stop: int
    ) -> tuple[Tensor, Tensor]:
        """Tokens and slots behind some of the layers; no slots behind the last layer there is."""
        if not self.design.attention:
            means = slots
            for layer in self.layers[start:stop]:
                means, slots = layer(slots)
            return means if tokens is None else tokens + means, slots
        count = len(self.rows.tokens)
        if tokens is None:
            tokens = self.tokens.expand(len(slots), -1, -1)
        rows = torch.cat([tokens, slots], 1)
        for number, layer in enumerate(self.layers[start:stop], start):
            last = number == len(self.layers) - 1
            rows = layer(rows, self.rows.tokens if last else (*self.rows.tokens, *self.rows.others))
        return rows[:, :count], rows[:, count:]

    def _convolved(self, tokens: Tensor, frames: int, number: int, motion: Tensor) -> Tensor:
        """The first convolution (eq. 6), and beside it that of what is in the slots themselves."""
        hidden = tokens.reshape(-1, frames, tokens.shape[1] * tokens.shape[2]).transpose(1, 2)
        hidden = self.convolutions[number](self._padded(hidden))
        if self.design.raw:
            raw = motion.index_select(2, self.raw_slots).flatten(2).transpose(1, 2)
            hidden = hidden + self.raw(self._padded(raw))
        return self._rectified(hidden)

    def _channels(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """How many the two convolutions read and write."""
        width, whole = self.design.width, self.parts * self.design.width
        if self.design.by_part:
            return (whole, whole), (whole, whole)
        inner = width if self.early < self.design.layers else whole
        return (width, inner), (inner, whole)

    def _add_raw(self, parts: Parts, outputs: int) -> None:
        chosen = torch.tensor([slot for part in parts for slot in part])
        self.register_buffer("raw_slots", chosen, persistent=False)
        sizes = [4 * len(part) for part in parts]
        self.raw = PartConvolution(sizes, outputs // len(parts), self.design.kernel)

    def _padded(self, hidden: Tensor) -> Tensor:
        kernel = self.design.kernel
        return functional.pad(hidden, ((kernel - 1) // 2, kernel // 2), mode="reflect")

    def _rectified(self, hidden: Tensor) -> Tensor:
        return functional.leaky_relu(hidden, self.design.leak)

    def _dropped(self, values: Tensor) -> Tensor:
        return functional.dropout(values, self.design.dropout, self.training)


def positions(slots: tuple[int, ...], width: int) -> Tensor:
    """The code of each slot's index ``(slots, width)`` (eq. 2)."""
    steps = torch.arange(0, width, 2, dtype=torch.float64)
    angles = torch.tensor(slots, dtype=torch.float64).unsqueeze(1) / BASIS ** (steps / width)
    return torch.stack([angles.sin(), angles.cos()], -1).flatten(1)[:, :width].float()
