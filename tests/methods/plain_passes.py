"""The plain form of every function with a hand-written backward pass, for tests and measurements.

Each takes what the function takes, gives what it gives, and leaves the gradient to autograd.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor
from torch.nn import functional

from retarget_bench.methods.humot.network import attention, local
from retarget_bench.methods.humot.network.tokens import Lines
from retarget_bench.motion import kinematics_torch


# ------------------------------------------------------------------------------------- PAN
def attend(
    queries: Tensor, keys: Tensor, values: Tensor, hidden: Tensor, real: Tensor, noise: Any
) -> Tensor:
    groups, _, asking, seen = hidden.shape
    frames, _, size = queries.shape
    shape = (frames, groups, -1)
    scores = queries.view(*shape, asking, size) @ keys.view(*shape, seen, size).mT
    weights = (scores * size**-0.5 + hidden).softmax(-1) * real
    if noise is not None:
        drawn = noise.bytes(frames * groups * weights.shape[2], asking, seen)
        weights = weights * noise.kept(drawn, weights.flatten(0, 2)).view_as(weights)
    return (weights @ values.view(*shape, seen, size)).view(queries.shape)


def gather(
    values: Tensor, back: Tensor, again: Tensor, more: Tensor, *pieces: Tensor
) -> tuple[Tensor, ...]:
    return tuple(values.index_select(1, piece) for piece in pieces)


def wide(values: Tensor, bend: str, noise: Any, *weights: Tensor) -> Tensor:
    *inner, last, bias = weights
    for weight, shift in zip(inner[::2], inner[1::2], strict=True):
        values = getattr(functional, bend)(functional.linear(values, weight, shift))
    if noise is not None:
        values = values * noise.kept(noise.bytes(*values.shape), values)
    return functional.linear(values, last, bias)


# ----------------------------------------------------------------------------------- HuMoT
def _spread(values: Tensor, lines: Lines) -> Tensor:
    """``(lines, frames, width)`` of ``(rows, frames, width)``: each sequence's, zero on blank lines."""
    counts = torch.tensor([count + 1 for count in lines.counts])
    return values.repeat_interleave(counts, 0).index_fill(0, lines.blank, 0.0)


def scaled(tokens: Tensor, style: Tensor, lines: Lines) -> Tensor:
    return torch.addcmul(tokens, tokens, _spread(style, lines)).index_fill(0, lines.blank, 0.0)


def added(tokens: Tensor, told: Tensor, lines: Lines) -> Tensor:
    return tokens + _spread(told, lines)


def means(tokens: Tensor, shares: Tensor, lines: Lines) -> Tensor:
    parts = zip(lines.over(tokens), torch.split(shares, [n - 1 for n in lines.counts]), strict=True)
    return torch.stack([torch.einsum("jfw,jw->fw", own[1:], each) for own, each in parts])


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


def fed_at_once(tokens: Tensor, pieces: list[slice], *weights: Tensor) -> Tensor:
    """All tokens together, blank ones included, which are zeroed again."""
    whole = fed(tokens, [slice(0, tokens.shape[0] * tokens.shape[1])], *weights)
    kept = torch.zeros(whole.shape[0] * whole.shape[1], 1)
    for piece in pieces:
        kept[piece] = 1.0
    return whole * kept.view(*whole.shape[:2], 1)


def _mixed_with(lines: Lines, values: Tensor, matrices: Tensor, plus: Tensor) -> Tensor:
    if lines.even:
        rows = [each.view(len(lines.counts), -1, each.shape[-1]) for each in (plus, values)]
        return torch.baddbmm(*rows, matrices).view_as(values)
    empty = plus.new_zeros(1, *plus.shape[1:])
    triples = zip(lines.over(plus), lines.over(values), matrices, strict=True)
    made = [each for one, own, matrix in triples for each in (one + own @ matrix, empty)]
    return torch.cat(made)


def summed(
    tokens: Tensor, weight: Tensor, bias: Tensor, lines: Lines, wanted: bool
) -> tuple[Tensor, Tensor, Tensor | None]:
    normed = functional.layer_norm(tokens, weight.shape, weight, bias, attention.EPSILON)
    normed = normed.index_fill(0, lines.blank, 0.0) if lines.mask is None else normed * lines.mask
    if lines.even:
        rows = normed.view(len(lines.counts), -1, normed.shape[-1])
        products = torch.bmm(rows.mT, rows)
    else:
        flat = [own.flatten(0, 1) for own in lines.over(normed)]
        products = torch.stack([own.T @ own for own in flat])
    return normed, products, lines.sums(normed) if wanted else None


def mixed(tokens: Tensor, normed: Tensor, matrices: Tensor, bias: Tensor, lines: Lines) -> Tensor:
    found = _mixed_with(lines, normed, matrices, tokens)
    counts = torch.tensor([count + 1 for count in lines.counts])
    spread = bias.repeat_interleave(counts, 0).unsqueeze(1)
    return found + spread if lines.even else found + spread.index_fill(0, lines.blank, 0.0)


def locally(tokens: Tensor, own: Lines, inner: Any, *weights: Tensor) -> Tensor:
    scale, shift, first, first_bias, second, second_bias, *affine = weights
    normed = functional.layer_norm(tokens, scale.shape, scale, shift, attention.EPSILON)
    hidden = local._convolved(own.emptied_(normed), first, first_bias)
    between, _ = inner.applied(functional.gelu(hidden), own, *affine)
    return tokens + local._convolved(own.emptied_(between), second, second_bias)


def multiplied(values: Tensor, weights: Tensor, bias: Tensor, there: Tensor, back: Tensor) -> Tensor:
    waves = there @ values
    half = len(weights) // 2
    cosines, sines = weights[1 : half + 1], weights[half + 1 :]
    real, imaginary = (waves[:, start::2].transpose(0, 1) for start in (1, 2))
    left = torch.bmm(real, cosines) - torch.bmm(imaginary, sines)
    right = torch.bmm(real, sines) + torch.bmm(imaginary, cosines)
    constant = waves[:, 0] @ weights[0]
    found = torch.stack([left, right], 1).flatten(0, 1).transpose(0, 1)
    return back @ torch.cat([constant.unsqueeze(1), found], 1) + bias


# ------------------------------------------------------------------------------ kinematics
def kinematics(local: Tensor, offsets: Tensor, tree: kinematics_torch.Tree) -> tuple[Tensor, Tensor]:
    chain = local
    for rows, above in tree.doublings:
        product = kinematics_torch._product(tree, chain.index_select(0, above), chain.index_select(0, rows))
        chain = chain.index_copy(0, rows, product)
    bones = kinematics_torch._turn(
        chain.index_select(0, tree.above).unbind(1), (offsets * tree.inner).unbind(1)
    )
    return kinematics_torch._along(tree.ancestors, torch.stack(bones, 1)), chain


def kinematics_by_level(
    local: Tensor, offsets: Tensor, tree: kinematics_torch.Tree
) -> tuple[Tensor, Tensor]:
    """Joint by joint of a shared tree, else level by level."""
    if tree.mask.ndim > 1:
        chain = local
        for rows, above in tree.levels:
            product = kinematics_torch._product(
                tree, chain.index_select(0, above), local.index_select(0, rows)
            )
            chain = chain.index_copy(0, rows, product)
    else:
        found: list[Tensor] = []
        for turn, parent in zip(local.unbind(0), tree.parents, strict=True):
            found.append(turn if parent < 0 else _hamilton(found[parent], turn))
        chain = torch.stack(found)
    bones = kinematics_torch._turn(
        chain.index_select(0, tree.above).unbind(1), (offsets * tree.inner).unbind(1)
    )
    return kinematics_torch._along(tree.ancestors, torch.stack(bones, 1)), chain


def _hamilton(a: Tensor, b: Tensor) -> Tensor:
    (p, q, r, s), (t, u, v, o) = a.unbind(0), b.unbind(0)
    parts: Sequence[Tensor] = (
        p * t - q * u - r * v - s * o,
        p * u + q * t + r * o - s * v,
        p * v - q * o + r * t + s * u,
        p * o + q * v - r * u + s * t,
    )
    return torch.stack(parts)
