"""SAN's networks built the plain way: dense layers times masks of 0 and 1, poolings as products.

Each takes over the weights of one of ours.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.methods.san.network import Decoder, Discriminator, Encoder, Skeletal, StaticEncoder
from retarget_bench.methods.san.skeleton import Levels, Slots, layout_of
from retarget_bench.methods.san.structure import Structure
from retarget_bench.training.layers.skeletal.layout import Layout

S23: Layout = layout_of(
    (-1, 0, 1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 12, 13, 12, 15, 16, 17, 12, 19, 20, 21), (None,) * 23
)
S28: Layout = layout_of(
    (-1, 0, 1, 2, 3, 4, 0, 6, 7, 8, 9, 0, 11, 12, 13, 14, 15, 16, 14, 18, 19, 20, 21, 14, 23, 24, 25, 26),
    (None,) * 28,
)
LEAK = 0.2


def dense(pairs: Sequence[tuple[int, int]], blocks: Tensor) -> Tensor:
    """``(slots * outputs, slots * inputs, taps)``, zero between slots that are no neighbours."""
    slots = 1 + max(slot for slot, _ in pairs)
    _, outputs, inputs, taps = blocks.shape
    weights = blocks.new_zeros(slots, outputs, slots, inputs, taps)
    for (slot, other), block in zip(pairs, blocks, strict=True):
        weights[slot, :, other] = block
    return weights.reshape(slots * outputs, slots * inputs, taps)


class Masked(nn.Module):
    """A dense layer times its mask."""

    def __init__(self, lean: Skeletal) -> None:
        super().__init__()
        self.weight = nn.Parameter(dense(lean.pairs, lean.weight.data))
        self.bias = None if lean.bias is None else nn.Parameter(lean.bias.data.flatten().clone())
        self.register_buffer("mask", dense(lean.pairs, torch.ones_like(lean.weight.data)))

    def linear(self, values: Tensor) -> Tensor:
        return functional.linear(values, (self.weight * self.mask)[..., 0], self.bias)

    def convolution(self, values: Tensor, stride: int, padding: int) -> Tensor:
        if padding:
            values = functional.pad(values, (padding, padding), mode="reflect")
        return functional.conv1d(values, self.weight * self.mask, self.bias, stride)


def pooling(groups: Slots, channels: int) -> Tensor:
    """``(groups * channels, slots * channels)`` means."""
    matrix = torch.zeros(len(groups), sum(map(len, groups)))
    for row, group in enumerate(groups):
        matrix[row, list(group)] = 1.0 / len(group)
    return torch.kron(matrix, torch.eye(channels))


def unpooling(groups: Slots, channels: int) -> Tensor:
    """``(slots * channels, groups * channels)`` copies."""
    return (pooling(groups, channels).T > 0).float()


class PlainStaticEncoder(nn.Module):
    def __init__(self, lean: StaticEncoder, levels: Levels) -> None:
        super().__init__()
        self.layers = nn.ModuleList(Masked(layer) for layer in lean.layers)
        self.register_buffer("pool", pooling(levels.first, 6))

    def forward(self, bones: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        own = bones.flatten(1)
        first = functional.leaky_relu(self.layers[0].linear(own) @ self.pool.T, LEAK)
        return own, first, functional.leaky_relu(self.layers[1].linear(first), LEAK)


class PlainEncoder(nn.Module):
    def __init__(self, lean: Encoder, levels: Levels) -> None:
        super().__init__()
        self.motion = nn.ModuleList(Masked(layer.motion) for layer in lean.layers)
        self.body = nn.ModuleList(Masked(layer.body) for layer in lean.layers)
        self.register_buffer("pool0", pooling(levels.first, 8))
        self.register_buffer("pool1", pooling(levels.chains, 16))

    def forward(self, motion: Tensor, codes: Sequence[Tensor]) -> Tensor:
        hidden = motion.flatten(2).transpose(1, 2)
        for number, pool in enumerate((self.pool0, self.pool1)):
            wide = self.motion[number].convolution(hidden, 2, 7)
            wide = wide + self.body[number].linear(codes[number]).unsqueeze(-1) / 100
            hidden = functional.leaky_relu(pool @ wide, LEAK)
        return hidden.transpose(1, 2).unflatten(2, (-1, 16))


class PlainDecoder(nn.Module):
    def __init__(self, lean: Decoder, levels: Levels) -> None:
        super().__init__()
        self.padded = lean.padded
        self.motion = nn.ModuleList(Masked(layer.motion) for layer in lean.layers)
        self.body = nn.ModuleList(Masked(layer.body) for layer in lean.layers)
        self.register_buffer("unpool0", unpooling(levels.chains, 16))
        self.register_buffer("unpool1", unpooling(levels.first, 8))

    def forward(self, code: Tensor, codes: Sequence[Tensor]) -> Tensor:
        hidden = code.flatten(2).transpose(1, 2)
        for number, unpool in enumerate((self.unpool0, self.unpool1)):
            hidden = functional.interpolate(hidden, scale_factor=2, mode="linear", align_corners=False)
            hidden = self.motion[number].convolution(unpool @ hidden, 1, 7)
            hidden = hidden + self.body[number].linear(codes[1 - number]).unsqueeze(-1) / 100
            hidden = hidden if number else functional.leaky_relu(hidden, LEAK)
        motion = hidden.transpose(1, 2).unflatten(2, (-1, 4))
        if self.padded:
            motion = motion.clone()
            motion[:, :, -1, 3] = 0.0
        return motion


class PlainDiscriminator(nn.Module):
    def __init__(self, lean: Discriminator, levels: Levels) -> None:
        super().__init__()
        self.first, self.last = Masked(lean.first), Masked(lean.last)
        self.norm = nn.BatchNorm1d(lean.norm.num_features)
        self.norm.load_state_dict(lean.norm.state_dict())
        self.register_buffer("pool0", pooling(levels.first, 6))
        self.register_buffer("pool1", pooling(levels.pairs, 12))

    def forward(self, values: Tensor) -> Tensor:
        hidden = self.first.convolution(values.flatten(2).transpose(1, 2), 2, 7)
        hidden = functional.leaky_relu(self.pool0 @ self.norm(hidden), LEAK)
        return (self.pool1 @ self.last.convolution(hidden, 2, 0)).sigmoid()


def make_plain(structure: Structure) -> Structure:
    """Put plain networks in the place of a structure's own."""
    levels = structure.levels
    structure.skeleton = PlainStaticEncoder(structure.skeleton, levels)
    structure.encoder = PlainEncoder(structure.encoder, levels)
    structure.decoder = PlainDecoder(structure.decoder, levels)
    return structure
