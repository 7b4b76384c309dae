"""HuMoT's decoder: joint positions of a body from a code per frame and the body's template."""

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from .block import Block
from .layers import ELU, RELU, Anchors, TemporalConvolution, initialise_orthogonal
from .tokens import RaggedTokens, elu_, in_groups, styled, time_code

NEAR = 4.0
"""What a token has in the channel of an anchor at its joint."""
STYLE, FIRST = 0.5, 0.1
"""Initial spread of styles and, about, of positions: noise there would teach to ignore codes."""


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
        initialise_orthogonal([*self.template, *(first for first, _ in styles)], RELU)
        initialise_orthogonal([last for _, last in styles], STYLE)
        initialise_orthogonal([*self.latent, self.shared, *self.motion, *self.written[:-1]], ELU)
        initialise_orthogonal(self.written[-1:], FIRST)

    def forward(self, code: Tensor, template: Tensor, joints: Tensor, frames: Tensor) -> Tensor:
        """Positions ``(rows, frames, joints, 3)`` in metres, zero where there is no joint or no frame.

        code: ``(rows, frames, latent)``. The others are as the encoder's.
        """
        ragged = RaggedTokens.of(joints, frames)
        tokens = self._tokens(template[joints], ragged)
        latent = self._latent(code, None if ragged.frames is None else frames.unsqueeze(2))
        for style_of, block in zip(self.styles, self.blocks, strict=True):
            tokens = styled(tokens, style_of(latent), ragged)
            tokens = block(tokens, ragged)
        return self._positions(tokens, ragged, joints)

    def _tokens(self, template: Tensor, ragged: RaggedTokens) -> Tensor:
        """Input of the first block, without its style ``(tracks, frames, width)``."""
        *inner, last = self.template
        template_tokens = template
        for layer in inner:
            template_tokens = functional.relu(layer(template_tokens), inplace=True)
        template_tokens = last(template_tokens)
        if self.anchors is not None:
            template_tokens = template_tokens + NEAR * self.anchors(template).softmax(1)
        time = time_code(ragged.length, self.design, template_tokens)
        tokens = template_tokens.new_zeros(ragged.total, ragged.length, self.design.width)
        return in_groups(tokens, ragged.behind(0), lambda group: template_tokens[group].unsqueeze(1) + time)

    def _latent(self, code: Tensor, mask: Tensor | None) -> Tensor:
        """``(rows, frames, width)``, which all styles are made from."""
        if mask is not None:
            code = code.masked_fill(~mask, 0.0)
        for layer in self.latent:
            code = elu_(layer(code))
            if mask is not None:
                code = code * mask
        return elu_(self.shared(code))

    def _positions(self, tokens: Tensor, ragged: RaggedTokens, joints: Tensor) -> Tensor:
        own, mask = ragged.behind(0), ragged.mask
        found = tokens.new_zeros(len(own), ragged.length, 3)

        def written(group: slice) -> Tensor:
            where = own[group]
            return self._written(tokens[where], None if mask is None else mask[where])

        every = torch.arange(len(own), device=own.device)
        tracks = in_groups(found, every, written)
        result = tracks.new_zeros(*joints.shape, ragged.length, 3)
        return result.index_put((joints,), tracks).transpose(1, 2)

    def _written(self, tracks: Tensor, mask: Tensor | None) -> Tensor:
        """Positions over time, from tokens ``(tracks, frames, width)``."""
        tracks = tracks if mask is None else tracks * mask
        for layer in self.motion:
            tracks = elu_(layer(tracks))
            if mask is not None:
                tracks = tracks * mask
        *inner, last = self.written
        for layer in inner:
            tracks = elu_(layer(tracks))
        tracks = last(tracks)
        return tracks if mask is None else tracks * mask
