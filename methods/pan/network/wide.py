"""Narrow in, narrow out, wide between: layers whose hidden numbers are never kept.

Rows go through all layers a cacheful at a time, and once more when gradients are wanted: to keep what is
between them for the whole would take as long, for memory that is new to the process, and much of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Literal

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable
from torch.nn import functional

from .dropout import Noise

Bend = Literal["relu", "gelu"]
CACHED = 1 << 18
"""Hidden numbers that are held at a time."""


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
        for piece in _pieces(values, weights):
            hidden = _hidden(values[piece], inner, bend)[-1][1]
            if noise is not None:
                ctx.drawn.append(noise.bytes(*hidden.shape))
                hidden = hidden.mul_(noise.kept(ctx.drawn[-1], hidden))
            torch.addmm(bias, hidden, last.T, out=result[piece])
        ctx.save_for_backward(values, *weights)
        return result

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        values, *weights = ctx.saved_tensors
        found = [torch.zeros_like(each) for each in weights]
        to_values = values.new_empty(len(values), values.shape[1] - 1) if ctx.needs_input_grad[0] else None
        drawn = iter(ctx.drawn)
        for piece in _pieces(values, weights):
            steps = _hidden(values[piece], weights[:-2], ctx.bend)
            given = pull[piece]
            kept = None if ctx.noise is None else ctx.noise.kept(next(drawn), steps[-1][1])
            for layer in reversed(range(1, len(weights) // 2)):
                flat, read = steps[layer - 1]
                if kept is not None:
                    read = read.mul_(kept)
                found[2 * layer].addmm_(given.T, read)
                found[2 * layer + 1] += given.sum(0)
                given = given @ weights[2 * layer]
                if kept is not None:
                    given, kept = given.mul_(kept), None
                given = _unbent(given, flat, ctx.bend)
            both = given.T @ values[piece]
            found[0] += both[:, :-1]
            found[1] += both[:, -1]
            if to_values is not None:
                torch.mm(given, weights[0], out=to_values[piece])
        return to_values, None, None, *found


_wide: Callable[..., Tensor] = _Wide.apply


def _pieces(values: Tensor, weights: tuple[Tensor, ...] | list[Tensor]) -> Iterator[slice]:
    """Rows in turn, so many that a layer's hidden numbers stay in the cache."""
    step = max(CACHED // max(len(each) for each in weights[1::2]), 64)
    return (slice(start, start + step) for start in range(0, len(values), step))


def _hidden(
    values: Tensor, weights: tuple[Tensor, ...] | list[Tensor], bend: Bend
) -> list[tuple[Tensor, Tensor]]:
    """What hidden layers give before and behind their rectifiers; values: with ones for the first bias."""
    steps: list[tuple[Tensor, Tensor]] = []
    for weight, bias in zip(weights[::2], weights[1::2], strict=True):
        if steps:
            flat = torch.addmm(bias, steps[-1][1], weight.T)
        else:
            flat = values @ torch.cat([weight, bias.unsqueeze(1)], 1).T
        steps.append((flat, flat.clamp_(min=0.0) if bend == "relu" else functional.gelu(flat)))
    return steps


def _unbent(given: Tensor, flat: Tensor, bend: Bend) -> Tensor:
    if bend == "relu":
        return torch.ops.aten.threshold_backward(given, flat, 0.0)
    return torch.ops.aten.gelu_backward(given, flat)
