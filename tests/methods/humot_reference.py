"""HuMoT's networks as they are described, in plain masked torch, around a copy of the weights of ours.

Tokens are ``(rows, joints * frames, width)`` and padded; queries, keys and values are worked out; pictures
are ``(rows, width, joints, frames)``. See Mourot et al., 2023, section 3.3 and appendix A.3; the block is
that of El-Nouby et al., 2021.
"""

from __future__ import annotations

import copy
import math

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.methods.humot.network import Decoder, Encoder
from retarget_bench.methods.humot.network.block import BatchNorm, Block


class PlainEncoder(nn.Module):
    """Takes over an encoder's weights; ``own`` has parameters of the same names."""

    def __init__(self, encoder: Encoder) -> None:
        super().__init__()
        self.own = copy.deepcopy(encoder)

    def forward(self, positions: Tensor, template: Tensor, joints: Tensor, frames: Tensor) -> Tensor:
        own, (rows, length, count, _) = self.own, positions.shape
        mask = joints.unsqueeze(2) & frames.unsqueeze(1)
        places = template
        for layer in own.template:
            template = functional.elu(layer(template))
        motion = positions.permute(0, 2, 3, 1).reshape(rows * count, 3, length)
        motion = along_time(own.motion, motion, mask.view(rows * count, 1, length))
        motion = motion.transpose(1, 2).reshape(rows, count, length, -1)
        for layer in own.joined:
            motion = functional.elu(layer(motion))
        repeated = template.unsqueeze(2).expand(-1, -1, length, -1)
        time = own.design.time * code_of_time(length, own.design.width, own.design.basis).to(template)
        tokens = own.merged(torch.cat([repeated, motion], 3)) + time
        latent = (own.token + time).expand(rows, 1, -1, -1)
        tokens = torch.cat([latent, tokens], 1)
        mask = torch.cat([frames.unsqueeze(1), mask], 1)
        for number, block in enumerate(own.blocks):
            if own.design.anchored:
                tokens = tokens + told(own.common[number], tokens[:, 1:], places, joints)
            tokens = through(block, tokens, mask)
        return own.code(tokens[:, 0]) * frames.unsqueeze(2)


class PlainDecoder(nn.Module):
    """Takes over a decoder's weights; ``own`` has parameters of the same names."""

    def __init__(self, decoder: Decoder) -> None:
        super().__init__()
        self.own = copy.deepcopy(decoder)

    def forward(self, code: Tensor, template: Tensor, joints: Tensor, frames: Tensor) -> Tensor:
        own, (rows, length, _), count = self.own, code.shape, joints.shape[1]
        mask = joints.unsqueeze(2) & frames.unsqueeze(1)
        *inner, last = own.template
        places = template
        for layer in inner:
            template = functional.relu(layer(template))
        template = last(template)
        if own.anchors is not None:
            template = template + 4.0 * torch.softmax(-distances(own.anchors, places), 2)
        time = own.design.time * code_of_time(length, own.design.width, own.design.basis).to(template)
        tokens = template.unsqueeze(2).expand(-1, -1, length, -1) + time
        latent = along_time(own.latent, code.transpose(1, 2), frames.unsqueeze(1)).transpose(1, 2)
        latent = functional.elu(own.shared(latent))
        for style_of, block in zip(own.styles, own.blocks, strict=True):
            style = style_of(latent)
            tokens = through(block, tokens * (1.0 + style.unsqueeze(1)), mask)
        motion = tokens.permute(0, 1, 3, 2).reshape(rows * count, -1, length)
        motion = along_time(own.motion, motion, mask.view(rows * count, 1, length)).transpose(1, 2)
        *inner, last = own.written
        for layer in inner:
            motion = functional.elu(layer(motion))
        places = last(motion).view(rows, count, length, 3) * mask.unsqueeze(3)
        return places.transpose(1, 2)


def distances(anchors: nn.Module, places: Tensor) -> Tensor:
    """``(rows, joints, width)`` squared, with an anchor's sharpness as the unit."""
    return (torch.cdist(places, anchors.places) * anchors.sharpness.exp()).square()


def told(layer: nn.Module, tokens: Tensor, places: Tensor, joints: Tensor) -> Tensor:
    """What is added to every token of a frame ``(rows, 1, frames, width)``."""
    near = (-distances(layer.anchors, places)).masked_fill(~joints.unsqueeze(2), -math.inf)
    means = torch.einsum("rjfw,rjw->rfw", layer.norm(tokens), near.softmax(1))
    return layer.told(layer.mean(means)).unsqueeze(1)


def through(block: Block, tokens: Tensor, mask: Tensor) -> Tensor:
    """A block on ``(rows, joints, frames, width)``; mask ``(rows, joints, frames)``."""
    rows, joints, frames, width = tokens.shape
    flat, mask = tokens.reshape(rows, -1, width), mask.reshape(rows, -1, 1)
    flat = flat + block.attention.scale * attended(block, flat, mask)
    flat = flat + block.local.scale * interacted(block, flat, mask, (joints, frames))
    feed = block.feed
    flat = flat + feed.scale * feed.narrow(functional.gelu(feed.wide(feed.norm(flat))))
    return flat.view(tokens.shape)


def attended(block: Block, tokens: Tensor, mask: Tensor) -> Tensor:
    own, (rows, count, width) = block.attention, tokens.shape
    qkv = own.qkv(own.norm(tokens)) * mask
    qkv = qkv.view(rows, count, 3, len(own.temperature), -1).permute(2, 0, 3, 4, 1)
    queries, keys, values = qkv[0], qkv[1], qkv[2]
    queries, keys = functional.normalize(queries, dim=-1), functional.normalize(keys, dim=-1)
    weights = ((queries @ keys.transpose(-2, -1)) * own.temperature).softmax(-1)
    return own.out((weights @ values).permute(0, 3, 1, 2).reshape(rows, count, width))


def interacted(block: Block, tokens: Tensor, mask: Tensor, sides: tuple[int, int]) -> Tensor:
    own, (rows, count, width) = block.local, tokens.shape
    picture = (own.norm(tokens) * mask).transpose(1, 2).reshape(rows, width, *sides)
    picture = functional.gelu(own.first(picture))
    if isinstance(own.inner, BatchNorm):
        picture = batch_normed(own.inner, picture, mask.view(rows, *sides))
    else:
        normed = functional.layer_norm(
            picture.permute(0, 2, 3, 1), (width,), own.inner.weight, own.inner.bias
        )
        picture = normed.permute(0, 3, 1, 2)
    picture = own.second(picture * mask.view(rows, 1, *sides))
    return picture.view(rows, width, count).transpose(1, 2)


def batch_normed(norm: BatchNorm, picture: Tensor, mask: Tensor) -> Tensor:
    """Torch's own norm on the real tokens, taken out and put back."""
    last = picture.permute(0, 2, 3, 1)
    normed = functional.batch_norm(
        last[mask], norm.mean, norm.variance, norm.weight, norm.bias, norm.training
    )
    return torch.zeros_like(last).masked_scatter(mask.unsqueeze(3), normed).permute(0, 3, 1, 2)


def along_time(layers: nn.ModuleList, values: Tensor, mask: Tensor) -> Tensor:
    """Convolutions of ``(tracks, channels, frames)`` with ELUs; mask ``(tracks, 1, frames)``."""
    values = values * mask
    for layer in layers:
        smoothed = functional.conv1d(values, layer.weight, layer.bias, padding=layer.kernel // 2)
        values = functional.elu(smoothed) * mask
    return values


def code_of_time(frames: int, width: int, basis: float) -> Tensor:
    code = torch.zeros(frames, width, dtype=torch.float64)
    for channel in range(width):
        angle = torch.arange(frames, dtype=torch.float64) / basis ** ((channel - channel % 2) / width)
        code[:, channel] = angle.cos() if channel % 2 else angle.sin()
    return code


def batch(counts: list[int], lengths: list[int], seed: int = 0) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Random positions, templates, joint masks and frame masks of sequences of these sizes."""
    generator = torch.Generator().manual_seed(seed)
    rows, most, longest = len(counts), max(counts), max(lengths)
    joints = torch.arange(most) < torch.tensor(counts).unsqueeze(1)
    frames = torch.arange(longest) < torch.tensor(lengths).unsqueeze(1)
    template = torch.randn(rows, most, 3, generator=generator) * 0.5
    moves = torch.randn(rows, longest, most, 3, generator=generator).cumsum(1) / math.sqrt(longest)
    return template.unsqueeze(1) + 0.3 * moves, template, joints, frames
