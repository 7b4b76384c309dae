"""HuMoT's decoder: a code for each frame and a template to where that body's joints are."""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from .block import Block
from .layers import ELU, RELU, Anchors, TemporalConvolution, spread
from .tokens import Lines, bent, coded, in_groups, scaled

NEAR = 4.0
"""What a token has in the channel of an anchor at its joint."""
STYLE, FIRST = 0.5, 0.1
"""How much styles vary at the start, and, about, positions: noise there would teach to pass codes over."""


class Decoder(nn.Module):
    """Tokens begin as the template's and are multiplied, before each block, by what the code says.

    They are multiplied by one more than what a block's style MLP answers: at the start answers are small,
    and tokens stay. That MLP has a rectifier between its two layers and none behind.
    """

    def __init__(self, design: Design) -> None:
        super().__init__()
        self.design, width = design, design.width
        sizes = (3, *design.template, 2 * design.template[-1], width)
        self.template = nn.ModuleList(nn.Linear(*each) for each in pairwise(sizes))
        self.anchors = Anchors(width) if design.anchored else None
        self.latent = nn.ModuleList(
            TemporalConvolution(design.latent if number == 0 else width, width, design.kernel)
            for number in range(3)
        )
        self.shared = nn.Linear(width, width)
        styles = [(nn.Linear(width, width), nn.Linear(width, width)) for _ in range(design.blocks[1])]
        self.styles = nn.ModuleList(nn.Sequential(first, nn.ReLU(), last) for first, last in styles)
        self.blocks = nn.ModuleList(Block(design) for _ in range(design.blocks[1]))
        self.motion = nn.ModuleList(TemporalConvolution(width, width, design.kernel) for _ in range(3))
        sizes = (*[width] * design.written, 3)
        self.written = nn.ModuleList(nn.Linear(*each) for each in pairwise(sizes))
        spread([*self.template, *(first for first, _ in styles)], RELU)
        spread([last for _, last in styles], STYLE)
        spread([*self.latent, self.shared, *self.motion, *self.written[:-1]], ELU)
        spread(self.written[-1:], FIRST)

    def forward(self, code: Tensor, template: Tensor, joints: Tensor, frames: Tensor) -> Tensor:
        """Positions ``(rows, frames, joints, 3)`` in metres, zero where there is no joint or no frame.

        code: ``(rows, frames, latent)``. The others are as the encoder's.
        """
        lines = Lines.of(joints, frames)
        tokens = self._tokens(template[joints], lines)
        latent = self._latent(code, None if lines.frames is None else frames.unsqueeze(2))
        for style_of, block in zip(self.styles, self.blocks, strict=True):
            tokens = scaled(tokens, style_of(latent), lines)
            tokens = block(tokens, lines)
        return self._positions(tokens, lines, joints)

    def _tokens(self, template: Tensor, lines: Lines) -> Tensor:
        """What the first block reads, but for its style ``(lines, frames, width)``."""
        *inner, last = self.template
        still = template
        for layer in inner:
            still = functional.relu(layer(still), inplace=True)
        still = last(still)
        if self.anchors is not None:
            still = still + NEAR * self.anchors(template).softmax(1)
        time = coded(lines.length, self.design, still)
        tokens = still.new_zeros(lines.total, lines.length, self.design.width)
        return in_groups(tokens, lines.behind(0), lambda group: still[group].unsqueeze(1) + time)

    def _latent(self, code: Tensor, mask: Tensor | None) -> Tensor:
        """``(rows, frames, width)``, which all styles are made from."""
        if mask is not None:
            code = code.masked_fill(~mask, 0.0)
        for layer in self.latent:
            code = bent(layer(code))
            if mask is not None:
                code = code * mask
        return bent(self.shared(code))

    def _positions(self, tokens: Tensor, lines: Lines, joints: Tensor) -> Tensor:
        own, mask = lines.behind(0), lines.mask
        found = tokens.new_zeros(len(own), lines.length, 3)

        def written(group: slice) -> Tensor:
            where = own[group]
            return self._written(tokens[where], None if mask is None else mask[where])

        every = torch.arange(len(own), device=own.device)
        tracks = in_groups(found, every, written)
        result = tracks.new_zeros(*joints.shape, lines.length, 3)
        return result.index_put((joints,), tracks).transpose(1, 2)

    def _written(self, tracks: Tensor, mask: Tensor | None) -> Tensor:
        """Positions over time, from tokens ``(tracks, frames, width)``."""
        tracks = tracks if mask is None else tracks * mask
        for layer in self.motion:
            tracks = bent(layer(tracks))
            if mask is not None:
                tracks = tracks * mask
        *inner, last = self.written
        for layer in inner:
            tracks = bent(layer(tracks))
        tracks = last(tracks)
        return tracks if mask is None else tracks * mask
