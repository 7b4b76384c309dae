"""Layers of PAN: ragged parts, an MLP that keeps nothing hidden, and dropout.

Weights of parts that differ in size are stored end to end, and padded only while they are used.
"""

import math
from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import Any, Literal, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable
from torch.nn import functional

Sizes = Sequence[int]


class Padded(nn.Module):
    """Blocks of several sizes, stored end to end, as blocks of the largest size.

    sizes: of the blocks.
    """

    index: Tensor

    def __init__(self, sizes: Sizes) -> None:
        super().__init__()
        self.largest, self.blocks = max(sizes), len(sizes)
        index = [block * self.largest + k for block, size in enumerate(sizes) for k in range(size)]
        self.register_buffer("index", torch.tensor(index), persistent=False)
        self.full = len(index) == self.blocks * self.largest

    def forward(self, stored: Tensor) -> Tensor:
        """``(blocks, largest, ...)``, zero where there is nothing, from ``(sum of sizes, ...)``."""
        rest = stored.shape[1:]
        if not self.full:
            padded = stored.new_zeros(self.blocks * self.largest, *rest)
            stored = padded.index_copy(0, self.index, stored)
        return stored.view(self.blocks, self.largest, *rest)


def uniform(shape: Sequence[int], readers: Sequence[tuple[int, int]]) -> nn.Parameter:
    """Weights initialised as torch does: uniform within one over the root of the number of inputs.

    readers: numbers of successive rows, and of their inputs.
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


class EdgeConvolution(nn.Module):
    """A convolution over time that writes each edge from its own parts.

    weight: ``(sum of sizes * 4, width, kernel)``: part by part, edge by edge. bias: ``(edges * 4,)``.
    """

    index: Tensor

    def __init__(self, parts: Sequence[Sequence[int]], width: int, kernel: int) -> None:
        super().__init__()
        edges = [edge for part in parts for edge in part]
        count = max(edges) + 1
        readers = [edges.count(edge) * width * kernel for edge in range(count)]
        shape = (4 * len(edges), width, kernel)
        self.weight = uniform(shape, [(4, readers[edge]) for edge in edges])
        self.bias = uniform((4 * count,), [(4, read) for read in readers])
        self.padded = Padded([4 * len(part) for part in parts])
        self.register_buffer("index", torch.tensor(edges), persistent=False)
        self.count = count

    def forward(self, values: Tensor) -> Tensor:
        """``(rows, edges * 4, frames)`` from ``(rows, parts * width, padded frames)``."""
        kernels = self.padded(self.weight).flatten(0, 1)
        padded = functional.conv1d(values, kernels, groups=self.padded.blocks)
        if not self.padded.full:
            padded = padded.index_select(1, self.padded.index)
        apart = padded.view(len(padded), -1, 4, padded.shape[-1])
        empty = self.bias.view(1, -1, 4, 1).expand(len(padded), -1, -1, padded.shape[-1])
        return empty.index_add(1, self.index, apart.to(empty.dtype)).flatten(1, 2)


LEVELS = 256
"""Dropout shares are rounded to one of so many; kept elements are scaled by the rounded share."""


class DropoutMask:
    """Draws the dropout masks of one pass through a network, a byte per element, from a seed of torch.

    share: of elements dropped. Torch's own dropout takes some fifteen times as long on a CPU.
    """

    def __init__(self, share: float, device: torch.device) -> None:
        self.limit = round(share * LEVELS)
        self.scale = LEVELS / (LEVELS - self.limit)
        self.device = device
        if device.type == "cpu":
            seed = int(torch.randint(2**62, ()))
            self.generator = np.random.Generator(np.random.SFC64(seed))

    def bytes(self, *shape: int) -> Tensor:
        """uint8."""
        if self.device.type != "cpu":
            return torch.randint(LEVELS, shape, dtype=torch.uint8, device=self.device)
        count = int(np.prod(shape))
        words = self.generator.integers(0, 2**64, -(-count // 8), dtype=np.uint64)
        return torch.from_numpy(words).view(torch.uint8)[:count].view(shape)

    def factors(self, drawn: Tensor, like: Tensor) -> Tensor:
        """Factors of elements, 0 or a little more than 1."""
        return torch.ge(drawn, self.limit, out=torch.empty_like(like)).mul_(self.scale)


def dropped(values: Tensor, mask: DropoutMask | None) -> Tensor:
    """Values behind dropout."""
    return values if mask is None else values * mask.factors(mask.bytes(*values.shape), values)


Activation = Literal["relu", "gelu"]
CACHED = 1 << 19
"""Hidden numbers that an MLP holds at a time."""
FEW = 16
"""Inputs, the one for the bias included, that are few: see ``_FirstGradient``."""


def mlp(
    values: Tensor, layers: nn.ModuleList, activation: Activation, mask: DropoutMask | None = None
) -> Tensor:
    """Linear layers with activations between them, and dropout before the last one.

    Rows go through all layers a cacheful at a time, and once more for the gradient: keeping what is hidden
    would take as long, and much memory. Its own backward pass makes a whole training step 1.43 times as
    fast as the plain form (default preset; ``released`` with 32 rows: 1.25 times).

    values: ``(rows, inputs)``; the result is ``(rows, outputs)``.
    """
    if values.device.type != "cpu" or torch.is_autocast_enabled("cpu"):
        return _plain(values, layers, activation, mask)
    weights = [each for layer in layers for each in (layer.weight, layer.bias)]
    return _mlp(values, activation, mask, *weights)


def _plain(
    values: Tensor, layers: nn.ModuleList, activation: Activation, mask: DropoutMask | None
) -> Tensor:
    """The same as it stands: on a GPU, where pieces are too small, and under autocast, which leaves
    hand-written products in single precision."""
    *inner, last = layers
    for layer in inner:
        values = layer(values)
        values = functional.relu_(values) if activation == "relu" else functional.gelu(values)
    result: Tensor = last(dropped(values, mask))
    return result


class _MLP(torch.autograd.Function):
    """The first bias is one more column of the first weights: it and its gradient cost no pass."""

    @staticmethod
    def forward(
        ctx: Any, values: Tensor, activation: Activation, mask: DropoutMask | None, *weights: Tensor
    ) -> Tensor:
        result = values.new_empty(len(values), len(weights[-1]))
        ctx.activation, ctx.mask, ctx.drawn = activation, mask, []
        values = torch.cat([values, values.new_ones(len(values), 1)], 1)
        *inner, last, bias = weights
        last = last.T.contiguous()
        work = _Workspace(inner, activation, values)
        for piece in work.pieces:
            hidden = work.hidden(values[piece], keep=False)[-1].active
            if mask is not None:
                ctx.drawn.append(mask.bytes(*hidden.shape))
                hidden = hidden.mul_(mask.factors(ctx.drawn[-1], hidden))
            torch.addmm(bias, hidden, last, out=result[piece])
        ctx.save_for_backward(values, *weights)
        return result

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, output_gradient: Tensor) -> tuple[Tensor | None, ...]:
        values, *weights = ctx.saved_tensors
        gradients = [torch.zeros_like(each) for each in weights]
        to_values = torch.empty_like(values[:, :-1]) if ctx.needs_input_grad[0] else None
        work, drawn = _Workspace(weights[:-2], ctx.activation, values), iter(ctx.drawn)
        first, inward = _FirstGradient(work.first), weights[0].T.contiguous()
        for piece in work.pieces:
            steps, gradient = work.hidden(values[piece], keep=True), output_gradient[piece]
            kept = None if ctx.mask is None else ctx.mask.factors(next(drawn), steps[-1].active)
            for layer in reversed(range(1, len(weights) // 2)):
                flat, active, spare = steps[layer - 1]
                if kept is not None:
                    active.mul_(kept)
                gradients[2 * layer].addmm_(gradient.T, active)
                gradients[2 * layer + 1] += gradient.sum(0)
                gradient = torch.mm(gradient, weights[2 * layer], out=spare)
                if kept is not None:
                    gradient, kept = gradient.mul_(kept), None
                work.undo(gradient, flat)
            first.add(values[piece], gradient)
            if to_values is not None and first.narrow:
                to_values[piece] = torch.mm(inward, gradient.T).T
            elif to_values is not None:
                torch.mm(gradient, weights[0], out=to_values[piece])
        gradients[:2] = first.gradients()
        return to_values, None, None, *gradients


_mlp: Callable[..., Tensor] = _MLP.apply


class Step(NamedTuple):
    """A hidden layer before and behind its activation, and memory for the gradient of the latter."""

    flat: Tensor
    active: Tensor
    spare: Tensor


class _FirstGradient:
    """The sum of the gradients of the first weights and bias.

    It is transposed: products are fast where their result is wide. With few inputs the bias is one more;
    with many, which fill the processor's registers, one more would cost a third.
    """

    def __init__(self, like: Tensor) -> None:
        height, inputs = like.shape
        self.narrow = inputs <= FEW
        self.weights = like.new_zeros(inputs if self.narrow else inputs - 1, height)
        self.bias = like.new_zeros(height)

    def add(self, values: Tensor, gradient: Tensor) -> None:
        """values: ``(rows, inputs + 1)``, ones last. gradient: ``(rows, hidden)``, the gradient there."""
        self.weights.addmm_(values[:, : len(self.weights)].T, gradient)
        if not self.narrow:
            self.bias += gradient.sum(0)

    def gradients(self) -> list[Tensor]:
        if self.narrow:
            return [self.weights[:-1].T, self.weights[-1]]
        return [self.weights.T, self.bias]


class _Workspace:
    """Memory for the hidden numbers of a piece, used again: allocating it would take as long as the work.

    weights: of the hidden layers. values: with ones behind them, for the first bias.
    """

    def __init__(self, weights: Sequence[Tensor], activation: Activation, values: Tensor) -> None:
        self.activation, self.weights = activation, weights
        self.first = torch.cat([weights[0], weights[1].unsqueeze(1)], 1)
        step = max(CACHED // max(len(each) for each in weights[1::2]), 64)
        self.pieces = [slice(start, start + step) for start in range(0, len(values), step)]
        rows = min(step, len(values))
        self.room = [values.new_empty(2, rows, len(bias)) for bias in weights[1::2]]

    def hidden(self, values: Tensor, keep: bool) -> list[Step]:
        """The hidden layers; without ``keep`` GELU is in place, and its input is lost."""
        steps: list[Step] = []
        for number, room in enumerate(self.room):
            flat, spare = room[:, : len(values)].unbind(0)
            if number:
                torch.addmm(
                    self.weights[2 * number + 1], steps[-1].active, self.weights[2 * number].T, out=flat
                )
            else:
                torch.mm(values, self.first.T, out=flat)
            if self.activation == "relu":
                active = flat.clamp_(min=0.0)
            elif keep:
                active = torch.ops.aten.gelu.out(flat, out=spare)
            else:
                active = torch.ops.aten.gelu_(flat)
            steps.append(Step(flat, active, spare))
        return steps

    def undo(self, gradient: Tensor, flat: Tensor) -> None:
        """Replace the gradient behind an activation by the one before it."""
        if self.activation == "relu":
            torch.ops.aten.threshold_backward.grad_input(gradient, flat, 0.0, grad_input=gradient)
        else:
            torch.ops.aten.gelu_backward.grad_input(gradient, flat, grad_input=gradient)
