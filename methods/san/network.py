"""SAN's networks: static and motion encoder, decoder, discriminator, in the sizes of the authors' code.

The authors write a skeletal convolution as a dense one times a mask, and pooling as a product with a
matrix. Here weights exist for pairs of neighbours only, and as both operators are linear, a pooling next to
a convolution is done once, to its weights: the convolution writes pooled slots, or reads them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.training.layers.skeletal.layout import Layout

from .skeleton import Levels, Neighbours, Slots

KERNEL, LAST = 15, 16
"""Taps of all convolutions, and of the discriminators' last."""
LEAK = 0.2
SHARE = 0.01
"""What is added for a body counts so much (authors' code)."""
BONE, PLACE, TURN = 3, 3, 4
"""Numbers per slot of bones, of what discriminators see, and of motion; every layer doubles them."""
STRIDE = 2
SEGMENT, LONG = 16, 64
"""Frames at the ends of a motion, more than a convolution reaches from either of them; and those from which
on these are so few of all that it pays to do them apart."""


@dataclass(frozen=True)
class Design:
    """neighbours: see ``Edges.neighbours``; ``released`` also has bones at the joints that they lead to,
    the root's first, beside neighbours that are counted by edges, so that edge e reads the bone to joint e
    and not e + 1. distance: of neighbours. padded: the root has three channels, and a zero as the fourth.
    """

    neighbours: Neighbours = "fixed"
    distance: int = 2
    padded: bool = False

    def levels(self, layout: Layout) -> Levels:
        return Levels.of(layout.parents, self.distance, self.neighbours)

    def arranged(self, slots: Tensor) -> Tensor:
        """Values of slots ``(..., slots, n)``, the root's last, as static encoders and discriminators have
        them."""
        return slots.roll(1, -2) if self.neighbours == "released" else slots


class Skeletal(nn.Module):
    """The weights of a skeletal operator: a matrix for each slot and each of its neighbours.

    weight: ``(pairs, outputs, inputs, taps)``, sorted by slot. bias: ``(slots, outputs)``, or None.
    written, read: groups of slots that a pooling behind it makes one (their mean), and that an unpooling
    before it makes of one (copies); None: there is no such operator.
    """

    index: Tensor
    share: Tensor
    row: Tensor
    row_share: Tensor
    frozen_kernel: Tensor | None
    frozen_bias: Tensor | None

    def __init__(
        self,
        neighbours: Slots,
        inputs: int,
        outputs: int,
        taps: int = 1,
        *,
        written: Slots | None = None,
        read: Slots | None = None,
        bias: bool = True,
    ) -> None:
        super().__init__()
        self.pairs = [(slot, other) for slot, near in enumerate(neighbours) for other in near]
        alone = tuple((slot,) for slot in range(len(neighbours)))
        rows, columns = _group(written or alone), _group(read or alone)
        self.rows, self.columns = len(written or alone), len(read or alone)
        size = [1.0 / len((written or alone)[rows[slot]]) for slot in range(len(neighbours))]
        tables = {
            "index": torch.tensor(
                [rows[slot] * self.columns + columns[other] for slot, other in self.pairs]
            ),
            "share": torch.tensor([size[slot] for slot, _ in self.pairs]).view(-1, 1, 1, 1),
            "row": torch.tensor([rows[slot] for slot in range(len(neighbours))]),
            "row_share": torch.tensor(size).unsqueeze(1),
        }
        for name, table in tables.items():
            self.register_buffer(name, table, persistent=False)
        # initialised as torch does: uniform within one over the root of the number of inputs
        limit = torch.tensor([(len(near) * inputs * taps) ** -0.5 for near in neighbours])
        of_pair = torch.tensor([slot for slot, _ in self.pairs])
        drawn = torch.rand(len(self.pairs), outputs, inputs, taps).mul_(2.0).sub_(1.0)
        self.weight = nn.Parameter(drawn * limit[of_pair].view(-1, 1, 1, 1))
        drawn = torch.rand(len(neighbours), outputs).mul_(2.0).sub_(1.0)
        self.bias = nn.Parameter(drawn * limit.unsqueeze(1)) if bias else None
        self.register_buffer("frozen_kernel", None, persistent=False)
        self.register_buffer("frozen_bias", None, persistent=False)

    def dense(self) -> tuple[Tensor, Tensor | None]:
        """The weights ``(rows * outputs, columns * inputs, taps)`` and bias ``(rows * outputs,)`` of an
        ordinary operator on all slots, with the poolings beside it in them."""
        if self.frozen_kernel is not None:
            return self.frozen_kernel, self.frozen_bias
        _, outputs, inputs, taps = self.weight.shape
        empty = self.weight.new_zeros(self.rows * self.columns, outputs, inputs, taps)
        blocks = empty.index_add(0, self.index, self.weight * self.share)
        blocks = blocks.view(self.rows, self.columns, outputs, inputs, taps).transpose(1, 2)
        kernel = blocks.reshape(self.rows * outputs, self.columns * inputs, taps)
        if self.bias is None:
            return kernel, None
        bias = self.bias.new_zeros(self.rows, outputs).index_add(0, self.row, self.bias * self.row_share)
        return kernel, bias.flatten()

    def freeze(self) -> None:
        """Make the dense weights once: they do not change any more."""
        with torch.no_grad():
            self.frozen_kernel, self.frozen_bias = self.dense()


class SkeletalLinear(Skeletal):
    """A skeletal operator on one vector per slot."""

    def forward(self, values: Tensor) -> Tensor:
        """``(bodies, rows * outputs)`` from ``(bodies, columns * inputs)``."""
        kernel, bias = self.dense()
        return functional.linear(values, kernel.squeeze(-1), bias)


class SkeletalConvolution(Skeletal):
    """A convolution over time, padded by reflection unless the padding is 0."""

    def __init__(
        self,
        neighbours: Slots,
        inputs: int,
        outputs: int,
        taps: int,
        stride: int,
        *,
        padding: int = KERNEL // 2,
        written: Slots | None = None,
        read: Slots | None = None,
        bias: bool = True,
    ) -> None:
        super().__init__(neighbours, inputs, outputs, taps, written=written, read=read, bias=bias)
        self.stride, self.padding = stride, padding

    def forward(self, values: Tensor, added: Tensor | None = None) -> Tensor:
        """``(motions, rows * outputs, frames / stride)`` from ``(motions, columns * inputs, frames)``.

        added: ``(motions, rows * outputs)``, the same in every frame."""
        kernel, bias = self.dense()
        result = self._convolved(values, kernel)
        if bias is None:
            return result
        return result.add_((bias if added is None else added + bias).unsqueeze(-1))

    def _convolved(self, values: Tensor, kernel: Tensor) -> Tensor:
        if self.padding:
            values = functional.pad(values, (self.padding, self.padding), mode="reflect")
        return functional.conv1d(values, kernel, stride=self.stride)


class DoublingConvolution(SkeletalConvolution):
    """A convolution that doubles the frames first, by linear interpolation.

    Once its weights are frozen, it is one convolution of the frames as they are, with fewer taps, for the
    even and for the odd frames of the answer. That takes three fifths of the products.
    """

    phases: Tensor | None

    def __init__(self, *sizes: Any, **groups: Any) -> None:
        super().__init__(*sizes, **groups)
        self.register_buffer("phases", None, persistent=False)

    def freeze(self) -> None:
        super().freeze()
        with torch.no_grad():
            kernel = self.dense()[0]
            self.phases = torch.einsum("oit,ptj->opij", kernel, _phases().to(kernel)).flatten(0, 1)

    def _convolved(self, values: Tensor, kernel: Tensor) -> Tensor:
        if self.phases is None or values.shape[-1] < LONG:
            return super()._convolved(_doubled(values), kernel)
        reach = self.phases.shape[-1] // 2
        inner = functional.conv1d(values, self.phases, padding=reach)
        answer = inner.view(len(values), -1, 2, values.shape[-1]).transpose(2, 3).flatten(2)
        # near the ends the reflection is of doubled frames, and no sum of frames as they are
        first, last = (
            super(DoublingConvolution, self)._convolved(_doubled(end), kernel)
            for end in (values[..., :SEGMENT], values[..., -SEGMENT:])
        )
        answer[..., :SEGMENT], answer[..., -SEGMENT:] = first[..., :SEGMENT], last[..., -SEGMENT:]
        return answer


class BodyConvolution(nn.Module):
    """A skeletal convolution, and a skeletal linear layer that adds the code of a body to it.

    channels: input and output channels per slot. bone: numbers per slot of the body's code. With a stride
    of 1 the convolution is one that doubles the frames."""

    def __init__(
        self,
        neighbours: Slots,
        channels: tuple[int, int],
        bone: int,
        stride: int,
        written: Slots | None = None,
        read: Slots | None = None,
    ) -> None:
        super().__init__()
        kind = DoublingConvolution if stride == 1 else SkeletalConvolution
        self.motion = kind(neighbours, *channels, KERNEL, stride, written=written, read=read)
        self.body = SkeletalLinear(neighbours, bone, channels[1], written=written)

    def forward(self, values: Tensor, code: Tensor) -> Tensor:
        answer: Tensor = self.motion(values, SHARE * self.body(code))
        return answer


class StaticEncoder(nn.Module):
    """Codes of a body, one for each layer of encoder and decoder.

    The last layer's code is read by nothing: the authors have one more layer than they use.
    """

    def __init__(self, levels: Levels) -> None:
        super().__init__()
        fine, coarse = levels.neighbours
        self.layers = nn.ModuleList(
            [
                SkeletalLinear(fine, BONE, 2 * BONE, written=levels.first),
                SkeletalLinear(coarse, 2 * BONE, 4 * BONE),
            ]
        )

    def forward(self, bones: Tensor) -> tuple[Tensor, Tensor]:
        """The bones themselves ``(bodies, slots * 3)`` and the first layer's code, from
        ``(bodies, slots, 3)``."""
        return bones.flatten(1), self.layer(0, bones.flatten(1))

    def layer(self, number: int, code: Tensor) -> Tensor:
        return functional.leaky_relu(self.layers[number](code), LEAK)


class Encoder(nn.Module):
    """Two skeletal convolutions of stride 2, each followed by a pooling and a rectifier."""

    def __init__(self, levels: Levels) -> None:
        super().__init__()
        fine, coarse = levels.neighbours
        self.layers = nn.ModuleList(
            [
                BodyConvolution(fine, (TURN, 2 * TURN), BONE, STRIDE, written=levels.first),
                BodyConvolution(coarse, (2 * TURN, 4 * TURN), 2 * BONE, STRIDE, written=levels.chains),
            ]
        )

    def forward(self, motion: Tensor, codes: Sequence[Tensor]) -> Tensor:
        """``(motions, frames / 4, chains + 1, 16)`` from ``(motions, frames, slots, 4)``.

        codes: of each motion's body, see ``StaticEncoder``."""
        hidden = motion.flatten(2).transpose(1, 2)
        for layer, code in zip(self.layers, codes, strict=True):
            hidden = functional.leaky_relu_(layer(hidden, code), LEAK)
        rows, channels, frames = hidden.shape
        return hidden.transpose(1, 2).reshape(rows, frames, channels // (4 * TURN), 4 * TURN)


class Decoder(nn.Module):
    """Twice: frames doubled by linear interpolation, unpooling, a skeletal convolution; between the two a
    rectifier."""

    def __init__(self, levels: Levels, padded: bool) -> None:
        super().__init__()
        fine, coarse = levels.neighbours
        self.padded = padded
        self.layers = nn.ModuleList(
            [
                BodyConvolution(coarse, (4 * TURN, 2 * TURN), 2 * BONE, 1, read=levels.chains),
                BodyConvolution(fine, (2 * TURN, TURN), BONE, 1, read=levels.first),
            ]
        )

    def forward(self, code: Tensor, codes: Sequence[Tensor]) -> Tensor:
        """``(motions, frames, slots, 4)`` from ``(motions, frames / 4, chains + 1, 16)`` and codes of the
        bodies that answer."""
        first, second = self.layers
        hidden = functional.leaky_relu_(first(code.flatten(2).transpose(1, 2), codes[1]), LEAK)
        motion = second(hidden, codes[0])
        if self.padded:
            motion = functional.pad(motion[:, :-1], (0, 0, 0, 1))
        rows, channels, frames = motion.shape
        return motion.transpose(1, 2).reshape(rows, frames, channels // TURN, TURN)


class Discriminator(nn.Module):
    """Scores of patches of a motion: two skeletal convolutions of stride 2, each followed by a pooling."""

    pooling: Tensor

    def __init__(self, levels: Levels) -> None:
        super().__init__()
        fine, coarse = levels.neighbours
        self.first = SkeletalConvolution(fine, PLACE, 2 * PLACE, KERNEL, STRIDE, bias=False)
        self.norm = nn.BatchNorm1d(2 * PLACE * len(fine))
        pooling = torch.zeros(len(levels.first), len(fine))
        for row, group in enumerate(levels.first):
            pooling[row, list(group)] = 1.0 / len(group)
        self.register_buffer("pooling", pooling, persistent=False)
        self.last = SkeletalConvolution(
            coarse, 2 * PLACE, 4 * PLACE, LAST, STRIDE, padding=0, written=levels.pairs
        )

    def forward(self, motion: Tensor) -> Tensor:
        """``(motions, scores of a patch, patches in time)`` between 0 and 1, from
        ``(motions, frames, slots, 3)``."""
        hidden = self.norm(self.first(motion.flatten(2).transpose(1, 2)))
        slots = hidden.view(len(hidden), self.pooling.shape[1], -1)
        hidden = functional.leaky_relu((self.pooling @ slots).view(len(hidden), -1, hidden.shape[-1]), LEAK)
        answer: Tensor = self.last(hidden)
        return answer.sigmoid()


def _doubled(hidden: Tensor) -> Tensor:
    return functional.interpolate(hidden, scale_factor=2, mode="linear", align_corners=False)


def _phases() -> Tensor:
    """``(2, taps, 9)``: what a tap on doubled frames, seen from an even and from an odd one of them, is on
    the frames as they are, which are a quarter of a frame away from those doubled."""
    weights = torch.zeros(2, KERNEL, KERNEL // 4 * 2 + 3)
    middle = weights.shape[-1] // 2
    for phase in range(2):
        for tap in range(KERNEL):
            frame, odd = divmod(tap - KERNEL // 2 + phase, 2)
            weights[phase, tap, middle + frame] = 0.75
            weights[phase, tap, middle + frame + (1 if odd else -1)] = 0.25
    return weights


def _group(groups: Slots) -> dict[int, int]:
    """Slot -> the number of its group."""
    return {slot: number for number, group in enumerate(groups) for slot in group}
