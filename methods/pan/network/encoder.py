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
from .dropout import Noise
from .plan import Parts, attending, body_parts, convolved_parts
from .ragged import PartConvolution
from .wide import wide

BASIS = 10_000.0
TOGETHER = 256
"""Frames that go through attention at a time: what they need stays in the cache."""


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
        rows, frames = motion.shape[:2]
        share = self.design.dropout
        noise = Noise(share, motion.device) if self.training and share > 0.0 else None
        tokens, slots = self._first(motion, noise)
        hidden = self.convolutions[0](self._padded(_over_time(tokens, rows)))
        if self.design.raw:
            raw = motion.index_select(2, self.raw_slots).flatten(2).transpose(1, 2)
            hidden = hidden + self.raw(self._padded(raw))
        hidden = self._rectified(hidden)
        if self.early < len(self.layers):
            tokens = hidden.view(rows, -1, self.design.width, frames // 2)
            tokens = self._second(tokens.permute(2, 1, 0, 3).flatten(2), slots, noise)
            hidden = _over_time(tokens, rows)
        hidden = self._rectified(self.convolutions[1](self._padded(hidden)))
        return hidden.transpose(1, 2).reshape(rows, -1, self.parts, self.design.width)

    def attention(self, motion: Tensor) -> Tensor:
        """How much each part's token heeds each slot in the first layer, the mean over heads.

        ``(rows, frames, parts, slots + 1)`` from ``(rows, frames, slots + 1, 4)``; without dropout. What a
        token leaves for itself is not in it, so that a part's weights add up to less than 1. Where the body
        is one part there is one. Raises ValueError where the encoder has no attention.
        """
        first = self.layers[0]
        if not isinstance(first, Attention):
            raise ValueError("this encoder was built without attention: there are no weights to show")
        rows = self._with_tokens(self._embedded(self._chosen(motion)))
        result = motion.new_zeros(*motion.shape[:2], len(self.rows.tokens), self.width)
        for token, group in enumerate(self.rows.tokens):
            seen = [self.rows.slots[key - len(self.rows.tokens)] for key in group.keys[1:]]
            weights = first.weights(rows, group)[0, 1:]
            result[:, :, token, seen] = weights.view(-1, *motion.shape[:2]).permute(1, 2, 0)
        return result

    def _first(self, motion: Tensor, noise: Noise | None) -> tuple[Tensor, Tensor]:
        """Tokens and slots ``(width, rows, rows * frames)`` before the first convolution."""
        found = []
        for values in torch.split(self._chosen(motion), TOGETHER, 2):
            slots = self._embedded(values)
            if noise is not None:
                slots = slots * noise.kept(noise.bytes(*slots.shape), slots)
            found.append(self._attended(None, slots, 0, self.early, noise))
        return torch.cat([tokens for tokens, _ in found], 2), torch.cat([slots for _, slots in found], 2)

    def _second(self, tokens: Tensor, slots: Tensor, noise: Noise | None) -> Tensor:
        """Tokens behind the layers that follow the first convolution, which has halved the frames."""
        slots = slots.view(*slots.shape[:2], -1, 2).mean(3)
        pairs = zip(torch.split(tokens, TOGETHER, 2), torch.split(slots, TOGETHER, 2), strict=True)
        found = [self._attended(*pair, self.early, len(self.layers), noise)[0] for pair in pairs]
        return torch.cat(found, 2)

    def _chosen(self, motion: Tensor) -> Tensor:
        """``(4, slots, rows * frames)`` of the slots that are rows of attention."""
        return motion.permute(3, 2, 0, 1).index_select(1, self.slots).flatten(2)

    def _embedded(self, values: Tensor) -> Tensor:
        """``(width, slots, frames)`` from ``(4, slots, frames)`` (eq. 1 to 3)."""
        flat = wide(values.reshape(4, -1), self.embedding, "relu").view(-1, *values.shape[1:])
        code = self.code.T.unsqueeze(2)
        return torch.add(code, flat, alpha=math.sqrt(len(flat)) if self.design.scaled else 1.0)

    def _with_tokens(self, slots: Tensor) -> Tensor:
        return torch.cat([self.tokens.T.unsqueeze(2).expand(-1, -1, slots.shape[2]), slots], 1)

    def _attended(
        self, tokens: Tensor | None, slots: Tensor, start: int, stop: int, noise: Noise | None
    ) -> tuple[Tensor, Tensor]:
        """Tokens and slots behind some of the layers; no slots behind the last layer there is."""
        if not self.design.attention:
            means = slots
            for layer in self.layers[start:stop]:
                means, slots = layer(slots)
            return means if tokens is None else tokens + means, slots
        count = len(self.rows.tokens)
        rows = self._with_tokens(slots) if tokens is None else torch.cat([tokens, slots], 1)
        for number, layer in enumerate(self.layers[start:stop], start):
            last = number == len(self.layers) - 1
            rows = layer(rows, self.rows.tokens if last else (*self.rows.tokens, *self.rows.others), noise)
        return rows[:, :count], rows[:, count:]

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


def _over_time(tokens: Tensor, rows: int) -> Tensor:
    """``(rows, parts * width, frames)`` from ``(width, parts, rows * frames)``."""
    width, parts, frames = tokens.shape
    return tokens.view(width, parts, rows, frames // rows).permute(2, 1, 0, 3).flatten(1, 2)


def positions(slots: tuple[int, ...], width: int) -> Tensor:
    """The code of each slot's index ``(slots, width)`` (eq. 2)."""
    steps = torch.arange(0, width, 2, dtype=torch.float64)
    angles = torch.tensor(slots, dtype=torch.float64).unsqueeze(1) / BASIS ** (steps / width)
    return torch.stack([angles.sin(), angles.cos()], -1).flatten(1)[:, :width].float()
