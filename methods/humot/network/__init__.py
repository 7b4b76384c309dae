"""HuMoT's networks: motion to a code that is independent of the body, and back for any template."""

from collections.abc import Iterable, Mapping
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.errors import BenchError
from retarget_bench.training.contract import Batch

from ..settings import Design
from .block import Block
from .layers import ELU, RELU, Anchors, FrameMean, TemporalConvolution, initialise_orthogonal
from .tokens import RaggedTokens, in_groups, styled, time_code

NEAR = 4.0
"""The value of a token in the channel of an anchor at its joint."""
STYLE, FIRST = 0.5, 0.1
"""Initial spread of styles and, about, of positions: noise there would teach to ignore codes."""


class Encoder(nn.Module):
    """Embeddings of motion and template, joint by joint, and blocks, of which a latent token is read.

    The latent token's track is the one before the first joint, where the paper appends it behind the last
    one: the mirror image of that. It is given the code of time, too, for else its frames would begin alike.
    """

    def __init__(self, design: Design) -> None:
        super().__init__()
        self.design = design
        sizes = (3, *design.template, design.motion[-1])
        self.template = nn.ModuleList(nn.Linear(*each) for each in pairwise(sizes))
        channels = (3, *design.motion)
        self.motion = nn.ModuleList(
            TemporalConvolution(*each, design.kernel) for each in pairwise(channels)
        )
        self.joined = nn.ModuleList(
            nn.Linear(design.motion[-1], design.motion[-1]) for _ in range(design.joined)
        )
        self.merged = nn.Linear(2 * design.motion[-1], design.width)
        self.token = nn.Parameter(0.02 * torch.randn(design.width))
        self.blocks = nn.ModuleList(Block(design) for _ in range(design.blocks[0]))
        self.common = nn.ModuleList(FrameMean(design) for _ in self.blocks if design.anchored)
        self.code = nn.Linear(design.width, design.latent)
        initialise_orthogonal([*self.template, *self.motion, *self.joined, self.merged, self.code], ELU)

    def forward(self, positions: Tensor, template: Tensor, ragged: RaggedTokens) -> Tensor:
        """The code ``(rows, frames, latent)``, zero where there is no frame.

        positions: ``(rows, frames, joints, 3)`` metres, Z up, centred. template: ``(rows, joints, 3)``.
        ragged: of both, with a latent track. What padding holds does not matter.
        """
        tracks = positions.transpose(1, 2)[ragged.rows, ragged.joints]
        mask = None
        if ragged.frames is not None:
            mask = ragged.frames[ragged.rows].unsqueeze(2)
            tracks = tracks.masked_fill(~mask, 0.0)
        template = template[ragged.rows, ragged.joints]
        tokens = self._tokens(tracks, _activated(self.template, template), ragged, mask)
        for number, block in enumerate(self.blocks):
            if self.design.anchored:
                tokens = self.common[number](tokens, template, ragged)
            tokens = block(tokens, ragged, latent=number == len(self.blocks) - 1)
        code = self.code(tokens[::2])
        return code if ragged.frames is None else code * ragged.frames.unsqueeze(2)

    def _tokens(
        self, tracks: Tensor, template: Tensor, ragged: RaggedTokens, mask: Tensor | None
    ) -> Tensor:
        """Input of the first block ``(tracks, frames, width)``."""
        half, weight = self.design.motion[-1], self.merged.weight
        still = functional.linear(template, weight[:, :half], self.merged.bias)
        time = time_code(ragged.length, self.design, still)
        tokens = tracks.new_zeros(ragged.total, ragged.length, self.design.width)
        tokens.index_copy_(0, ragged.leading, (self.token + time).expand(len(ragged.counts), -1, -1))

        def embedded(group: slice) -> Tensor:
            moving = _activated(self.motion, tracks[group], None if mask is None else mask[group])
            moving = functional.linear(_activated(self.joined, moving), weight[:, half:])
            return moving + still[group].unsqueeze(1) + time

        return in_groups(tokens, ragged.own, embedded)


class Decoder(nn.Module):
    """Tokens begin as the template's and are multiplied, before each block, by a projection of the code.

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

    def forward(self, code: Tensor, template: Tensor, ragged: RaggedTokens) -> Tensor:
        """Positions ``(rows, frames, joints, 3)`` in metres, zero where there is no joint or no frame.

        code: ``(rows, frames, latent)``. template: ``(rows, joints, 3)``, which ``ragged`` is of.
        """
        tokens = self._tokens(template[ragged.rows, ragged.joints], ragged)
        mask = None if ragged.frames is None else ragged.frames.unsqueeze(2)
        code = code if mask is None else code.masked_fill(~mask, 0.0)
        latent = functional.elu_(self.shared(_activated(self.latent, code, mask)))
        for style_of, block in zip(self.styles, self.blocks, strict=True):
            tokens = block(styled(tokens, style_of(latent), ragged), ragged)
        own = ragged.own

        def written(group: slice) -> Tensor:
            mask = None if ragged.mask is None else ragged.mask[own[group]]
            tracks = tokens[own[group]]
            tracks = _activated(self.motion, tracks if mask is None else tracks * mask, mask)
            tracks = self.written[-1](_activated(self.written[:-1], tracks))
            return tracks if mask is None else tracks * mask

        every = torch.arange(len(own), device=own.device)
        tracks = in_groups(tokens.new_zeros(len(own), ragged.length, 3), every, written)
        result = tracks.new_zeros(*template.shape[:2], ragged.length, 3)
        return result.index_put((ragged.rows, ragged.joints), tracks).transpose(1, 2)

    def _tokens(self, template: Tensor, ragged: RaggedTokens) -> Tensor:
        """Input of the first block, without its style ``(tracks, frames, width)``."""
        hidden = template
        for layer in self.template[:-1]:
            hidden = functional.relu_(layer(hidden))
        still = self.template[-1](hidden)
        if self.anchors is not None:
            still = still + NEAR * self.anchors(template).softmax(1)
        time = time_code(ragged.length, self.design, still)
        tokens = still.new_zeros(ragged.total, ragged.length, self.design.width)
        return in_groups(tokens, ragged.own, lambda group: still[group].unsqueeze(1) + time)


def _activated(layers: Iterable[nn.Module], values: Tensor, mask: Tensor | None = None) -> Tensor:
    """Values behind layers, each with an exponential linear unit, zero where the mask is."""
    for layer in layers:
        values = functional.elu_(layer(values))
        values = values if mask is None else values * mask
    return values


class Autoencoder(nn.Module):
    """Encoder and decoder, for all structures."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        self.encoder, self.decoder = Encoder(design), Decoder(design)

    def forward(self, source: Batch, target: Batch, tokens: tuple[RaggedTokens, RaggedTokens]) -> Tensor:
        """``(rows, frames, joints of the target, 3)`` metres. The arguments: see ``HumotTraining.draw``."""
        code = self.encoder(source["places"], source["template"], tokens[0])
        answer: Tensor = self.decoder(code, target["template"], tokens[1])
        return answer

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        """Take over weights. Raises BenchError where they do not fit."""
        try:
            self.load_state_dict(tensors)
        except RuntimeError as error:
            raise BenchError(f"these weights do not fit humot's networks: {error}") from None
