"""Layers whose parts differ in size: weights are stored end to end, and padded only while they are used."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate

import torch
from torch import Tensor, nn
from torch.nn import functional

Sizes = Sequence[int]


class Padded(nn.Module):
    """Where what is stored end to end lies among blocks of the largest size.

    sizes: of the blocks.
    """

    places: Tensor

    def __init__(self, sizes: Sizes) -> None:
        super().__init__()
        self.largest, self.blocks = max(sizes), len(sizes)
        places = [block * self.largest + k for block, size in enumerate(sizes) for k in range(size)]
        self.register_buffer("places", torch.tensor(places), persistent=False)
        self.full = len(places) == self.blocks * self.largest

    def forward(self, stored: Tensor) -> Tensor:
        """``(blocks, largest, ...)``, zero where there is nothing, from ``(sum of sizes, ...)``."""
        rest = stored.shape[1:]
        if not self.full:
            wide = stored.new_zeros(self.blocks * self.largest, *rest)
            stored = wide.index_copy(0, self.places, stored)
        return stored.view(self.blocks, self.largest, *rest)


def uniform(shape: Sequence[int], readers: Sequence[tuple[int, int]]) -> nn.Parameter:
    """Weights as torch begins with: uniform within one over the root of what is read.

    readers: how many rows in turn, and how many numbers each of them is read with.
    """
    values = torch.rand(*shape).mul_(2.0).sub_(1.0)
    ends = accumulate(rows for rows, _ in readers)
    for end, (rows, read) in zip(ends, readers, strict=True):
        values[end - rows : end] /= math.sqrt(read)
    return nn.Parameter(values)


class PartLinear(nn.Module):
    """A linear layer for each part, from as many numbers as it has.

    weight: ``(sum of sizes, outputs)``. bias: ``(parts, outputs)``.
    """

    def __init__(self, sizes: Sizes, outputs: int) -> None:
        super().__init__()
        self.weight = uniform((sum(sizes), outputs), [(size, size) for size in sizes])
        self.bias = uniform((len(sizes), outputs), [(1, size) for size in sizes])
        self.padded = Padded(sizes)

    def forward(self, values: Tensor) -> Tensor:
        """``(rows, parts, outputs)`` from ``(rows, sum of sizes)``."""
        inputs = self.padded(values.T)
        return torch.baddbmm(
            self.bias.unsqueeze(1), inputs.transpose(1, 2), self.padded(self.weight)
        ).transpose(0, 1)


class PartConvolution(nn.Module):
    """A convolution over time for each part, of stride 2, from as many channels as it has.

    weight: ``(sum of sizes, outputs, kernel)``. bias: ``(parts * outputs,)``.
    """

    def __init__(self, sizes: Sizes, outputs: int, kernel: int) -> None:
        super().__init__()
        shape = (sum(sizes), outputs, kernel)
        self.weight = uniform(shape, [(size, size * kernel) for size in sizes])
        self.bias = uniform((len(sizes) * outputs,), [(outputs, size * kernel) for size in sizes])
        self.padded = Padded(sizes)

    def kernels(self) -> Tensor:
        """``(parts * outputs, largest, kernel)``, as a grouped convolution wants them."""
        return self.padded(self.weight).transpose(1, 2).flatten(0, 1)

    def forward(self, values: Tensor) -> Tensor:
        """``(rows, parts * outputs, frames)`` from ``(rows, sum of sizes, padded frames)``."""
        inputs = self.padded(values.transpose(0, 1)).permute(2, 0, 1, 3).flatten(1, 2)
        return functional.conv1d(inputs, self.kernels(), self.bias, stride=2, groups=self.padded.blocks)


class SlotConvolution(nn.Module):
    """A convolution over time that writes slots, each from the parts that it is written from.

    weight: ``(sum of sizes * 4, width, kernel)``: part by part, slot by slot. bias: ``(slots * 4,)``.
    """

    places: Tensor

    def __init__(self, parts: Sequence[Sequence[int]], width: int, kernel: int) -> None:
        super().__init__()
        slots = [slot for part in parts for slot in part]
        count = max(slots) + 1
        readers = [slots.count(slot) * width * kernel for slot in range(count)]
        shape = (4 * len(slots), width, kernel)
        self.weight = uniform(shape, [(4, readers[slot]) for slot in slots])
        self.bias = uniform((4 * count,), [(4, read) for read in readers])
        self.padded = Padded([4 * len(part) for part in parts])
        self.register_buffer("places", torch.tensor(slots), persistent=False)
        self.count = count

    def forward(self, values: Tensor) -> Tensor:
        """``(rows, slots * 4, frames)`` from ``(rows, parts * width, padded frames)``."""
        kernels = self.padded(self.weight).flatten(0, 1)
        wide = functional.conv1d(values, kernels, groups=self.padded.blocks)
        if not self.padded.full:
            wide = wide.index_select(1, self.padded.places)
        apart = wide.view(len(wide), -1, 4, wide.shape[-1])
        empty = self.bias.view(1, -1, 4, 1).expand(len(wide), -1, -1, wide.shape[-1])
        return empty.index_add(1, self.places, apart).flatten(1, 2)
