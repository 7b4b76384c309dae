"""Narrow in, narrow out, wide between: layers whose hidden numbers are never kept.

Rows go through all layers a cacheful at a time, and once more when gradients are wanted: to keep what is
between them for the whole would take as long, for memory that is new to the process, and much of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from .dropout import Noise

Bend = Literal["relu", "gelu"]
CACHED = 1 << 19
"""Hidden numbers that are held at a time."""
FEW = 16
"""Inputs, the one for the bias counted, that are few: see ``_First``."""


def wide(values: Tensor, layers: nn.ModuleList, bend: Bend, noise: Noise | None = None) -> Tensor:
    """Linear layers with rectifiers between them, and dropout before the last one.

    values: ``(rows, inputs)``; the result is ``(rows, outputs)``.
    """
    weights = [each for layer in layers for each in (layer.weight, layer.bias)]
    return _wide(values, bend, noise, *weights)


class _Wide(torch.autograd.Function):
    """The first bias is a column more of the first weights: adding it, and its gradient, cost no pass."""

    @staticmethod
    def forward(ctx: Any, values: Tensor, bend: Bend, noise: Noise | None, *weights: Tensor) -> Tensor:
        result = values.new_empty(len(values), len(weights[-1]))
        ctx.bend, ctx.noise, ctx.drawn = bend, noise, []
        values = torch.cat([values, values.new_ones(len(values), 1)], 1)
        *inner, last, bias = weights
        last = last.T.contiguous()
        work = _Work(inner, bend, values)
        for piece in work.pieces:
            hidden = work.hidden(values[piece], keep=False)[-1].bent
            if noise is not None:
                ctx.drawn.append(noise.bytes(*hidden.shape))
                hidden = hidden.mul_(noise.kept(ctx.drawn[-1], hidden))
            torch.addmm(bias, hidden, last, out=result[piece])
        ctx.save_for_backward(values, *weights)
        return result

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        values, *weights = ctx.saved_tensors
        found = [torch.zeros_like(each) for each in weights]
        to_values = torch.empty_like(values[:, :-1]) if ctx.needs_input_grad[0] else None
        work, drawn = _Work(weights[:-2], ctx.bend, values), iter(ctx.drawn)
        first, inward = _First(work.first), weights[0].T.contiguous()
        for piece in work.pieces:
            steps, given = work.hidden(values[piece], keep=True), pull[piece]
            kept = None if ctx.noise is None else ctx.noise.kept(next(drawn), steps[-1].bent)
            for layer in reversed(range(1, len(weights) // 2)):
                flat, bent, spare = steps[layer - 1]
                if kept is not None:
                    bent.mul_(kept)
                found[2 * layer].addmm_(given.T, bent)
                found[2 * layer + 1] += given.sum(0)
                given = torch.mm(given, weights[2 * layer], out=spare)
                if kept is not None:
                    given, kept = given.mul_(kept), None
                work.unbend(given, flat)
            first.add(values[piece], given)
            if to_values is not None and first.narrow:
                to_values[piece] = torch.mm(inward, given.T).T
            elif to_values is not None:
                torch.mm(given, weights[0], out=to_values[piece])
        found[:2] = first.found()
        return to_values, None, None, *found


_wide: Callable[..., Tensor] = _Wide.apply


class Step(NamedTuple):
    """A hidden layer before and behind its rectifier, and room for its gradient once the latter is read."""

    flat: Tensor
    bent: Tensor
    spare: Tensor


class _First:
    """The sum of the gradients of the first weights and bias.

    It lies on its side: products are fast where their result is wide. Few inputs take the bias along as
    one more; many are as many as fit the processor's registers, and one more would cost a third.
    """

    def __init__(self, like: Tensor) -> None:
        height, inputs = like.shape
        self.narrow = inputs <= FEW
        self.weights = like.new_zeros(inputs if self.narrow else inputs - 1, height)
        self.bias = like.new_zeros(height)

    def add(self, values: Tensor, given: Tensor) -> None:
        """values: ``(rows, inputs + 1)``, ones last. given: ``(rows, hidden)``, the gradient there."""
        self.weights.addmm_(values[:, : len(self.weights)].T, given)
        if not self.narrow:
            self.bias += given.sum(0)

    def found(self) -> list[Tensor]:
        if self.narrow:
            return [self.weights[:-1].T, self.weights[-1]]
        return [self.weights.T, self.bias]


class _Work:
    """Room for the hidden numbers of a piece, the same for all: new memory would cost as much as the work.

    weights: of the hidden layers. values: with ones behind them, for the first bias.
    """

    def __init__(self, weights: Sequence[Tensor], bend: Bend, values: Tensor) -> None:
        self.bend, self.weights = bend, weights
        self.first = torch.cat([weights[0], weights[1].unsqueeze(1)], 1)
        step = max(CACHED // max(len(each) for each in weights[1::2]), 64)
        self.pieces = [slice(start, start + step) for start in range(0, len(values), step)]
        rows = min(step, len(values))
        self.room = [values.new_empty(2, rows, len(bias)) for bias in weights[1::2]]

    def hidden(self, values: Tensor, keep: bool) -> list[Step]:
        """Layer by layer. Unless it is to be kept, what GELU reads is not there any more."""
        steps: list[Step] = []
        for number, room in enumerate(self.room):
            flat, spare = room[:, : len(values)].unbind(0)
            if number:
                torch.addmm(
                    self.weights[2 * number + 1], steps[-1].bent, self.weights[2 * number].T, out=flat
                )
            else:
                torch.mm(values, self.first.T, out=flat)
            if self.bend == "relu":
                bent = flat.clamp_(min=0.0)
            elif keep:
                bent = torch.ops.aten.gelu.out(flat, out=spare)
            else:
                bent = torch.ops.aten.gelu_(flat)
            steps.append(Step(flat, bent, spare))
        return steps

    def unbend(self, given: Tensor, flat: Tensor) -> None:
        """The gradient before a rectifier, in the place of the one behind it."""
        if self.bend == "relu":
            torch.ops.aten.threshold_backward.grad_input(given, flat, 0.0, grad_input=given)
        else:
            torch.ops.aten.gelu_backward.grad_input(given, flat, grad_input=given)
