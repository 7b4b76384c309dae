"""The plain form of every function with a hand-written backward pass, for tests and measurements.

Each takes what the function takes, gives what it gives, and leaves the gradient to autograd.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor
from torch.nn import functional

from retarget_bench.methods.humot.network import attention
from retarget_bench.methods.humot.network.tokens import RaggedTokens


# ------------------------------------------------------------------------------------- PAN
def mlp(values: Tensor, activation: str, mask: Any, *weights: Tensor) -> Tensor:
    *inner, last, bias = weights
    for weight, shift in zip(inner[::2], inner[1::2], strict=True):
        values = getattr(functional, activation)(functional.linear(values, weight, shift))
    if mask is not None:
        values = values * mask.kept(mask.bytes(*values.shape), values)
    return functional.linear(values, last, bias)


# ----------------------------------------------------------------------------------- HuMoT
def fed(tokens: Tensor, pieces: list[slice], *weights: Tensor) -> Tensor:
    scale, shift, wide, wide_bias, narrow, narrow_bias = weights
    flat = tokens.flatten(0, 1)
    found = []
    stop = 0
    for piece in [*pieces, slice(len(flat), len(flat))]:
        if piece.start > stop:
            found.append(torch.zeros_like(flat[stop : piece.start]))
        values, stop = flat[piece], piece.stop
        normed = functional.layer_norm(values, scale.shape, scale, shift, attention.EPSILON)
        hidden = functional.gelu(functional.linear(normed, wide, wide_bias))
        found.append(values + functional.linear(hidden, narrow, narrow_bias))
    return torch.cat(found).view_as(tokens)


def _mixed_with(ragged: RaggedTokens, values: Tensor, matrices: Tensor, plus: Tensor) -> Tensor:
    if ragged.even:
        rows = [each.view(len(ragged.counts), -1, each.shape[-1]) for each in (plus, values)]
        return torch.baddbmm(*rows, matrices).view_as(values)
    empty = plus.new_zeros(1, *plus.shape[1:])
    triples = zip(ragged.over(plus), ragged.over(values), matrices, strict=True)
    made = [each for one, own, matrix in triples for each in (one + own @ matrix, empty)]
    return torch.cat(made)


def summed(
    tokens: Tensor, weight: Tensor, bias: Tensor, ragged: RaggedTokens, wanted: bool
) -> tuple[Tensor, Tensor, Tensor | None]:
    normed = functional.layer_norm(tokens, weight.shape, weight, bias, attention.EPSILON)
    normed = normed.index_fill(0, ragged.blank, 0.0) if ragged.mask is None else normed * ragged.mask
    if ragged.even:
        rows = normed.view(len(ragged.counts), -1, normed.shape[-1])
        products = torch.bmm(rows.mT, rows)
    else:
        flat = [own.flatten(0, 1) for own in ragged.over(normed)]
        products = torch.stack([own.T @ own for own in flat])
    return normed, products, ragged.sums(normed) if wanted else None


def mixed(tokens: Tensor, normed: Tensor, matrices: Tensor, bias: Tensor, ragged: RaggedTokens) -> Tensor:
    found = _mixed_with(ragged, normed, matrices, tokens)
    counts = torch.tensor([count + 1 for count in ragged.counts])
    spread = bias.repeat_interleave(counts, 0).unsqueeze(1)
    return found + spread if ragged.even else found + spread.index_fill(0, ragged.blank, 0.0)
