"""HuMoT's encoder: a code per frame from the joint positions of any body."""

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from .block import Block
from .layers import ELU, FrameMean, TemporalConvolution, initialise_orthogonal
from .tokens import RaggedTokens, elu_, in_groups, time_code


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

    def forward(self, positions: Tensor, template: Tensor, joints: Tensor, frames: Tensor) -> Tensor:
        """The code ``(rows, frames, latent)``, zero where there is no frame.

        positions: ``(rows, frames, joints, 3)`` metres, Z up, centred. template: ``(rows, joints, 3)``.
        joints: ``(rows, joints)``, True where there is one. frames: ``(rows, frames)``, True where there is
        one; padding lies behind. What padding holds does not matter.
        """
        ragged = RaggedTokens.of(joints, frames, more=1)
        tracks = positions.transpose(1, 2)[joints]
        mask = None
        if ragged.frames is not None:
            mask = frames.repeat_interleave(joints.sum(1), 0).unsqueeze(2)
            tracks = tracks.masked_fill(~mask, 0.0)
        template = template[joints]
        embedded_template = template
        for layer in self.template:
            embedded_template = elu_(layer(embedded_template))
        tokens = self._tokens(tracks, embedded_template, ragged, mask)
        for number, block in enumerate(self.blocks):
            if self.design.anchored:
                tokens = self.common[number](tokens, template, ragged)
            tokens = block(tokens, ragged, kept=1 if number == len(self.blocks) - 1 else None)
        code = self.code(tokens[::2])
        return code if ragged.frames is None else code * frames.unsqueeze(2)

    def _tokens(
        self, tracks: Tensor, template: Tensor, ragged: RaggedTokens, mask: Tensor | None
    ) -> Tensor:
        """Input of the first block ``(tracks, frames, width)``."""
        half = self.design.motion[-1]
        weight = self.merged.weight
        embedded_template = functional.linear(template, weight[:, :half], self.merged.bias)
        time = time_code(ragged.length, self.design, embedded_template)
        tokens = tracks.new_zeros(ragged.total, ragged.length, self.design.width)
        tokens.index_copy_(0, ragged.leading, (self.token + time).expand(len(ragged.counts), -1, -1))

        def embedded(group: slice) -> Tensor:
            moving = self._embedded(tracks[group], None if mask is None else mask[group])
            return (
                functional.linear(moving, weight[:, half:]) + embedded_template[group].unsqueeze(1) + time
            )

        return in_groups(tokens, ragged.behind(1), embedded)

    def _embedded(self, tracks: Tensor, mask: Tensor | None) -> Tensor:
        """``(tracks, frames, channels)`` from positions over time."""
        for layer in self.motion:
            tracks = elu_(layer(tracks))
            if mask is not None:
                tracks = tracks * mask
        for layer in self.joined:
            tracks = elu_(layer(tracks))
        return tracks
