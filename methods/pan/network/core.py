"""Scores, softmax and sums of attention among few rows, for many frames at once.

Frames lie last, as long runs: with five rows that see six of them, and 16 numbers each, products of whole
runs are several times as fast as small matrices.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from .dropout import Noise
from .plan import Group


class Seen(NamedTuple):
    """Of one group, ``(heads, queries, keys, frames)``: weights, and what dropout multiplied them by."""

    weights: Tensor
    drawn: Tensor | None


def attend(
    queries: Tensor, pairs: Tensor, groups: Sequence[Group], heads: int, noise: Noise | None
) -> Tensor:
    """``(width, queries, frames)``: what each query gathers from the rows that its group sees.

    queries: ``(width, queries, frames)``, of the groups in order. pairs: ``(2 * width, rows, frames)``,
    keys and values.
    """
    return _attend(queries, pairs, groups, heads, noise)


def weigh(queries: Tensor, keys: Tensor) -> Tensor:
    """Softmax of products, ``(heads, queries, keys, frames)``, from ``(heads, size, rows, frames)``."""
    scores = (queries.unsqueeze(3) * keys.unsqueeze(2)).sum(1)
    return scores.mul_(queries.shape[1] ** -0.5).softmax(2)


class _Attend(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, queries: Tensor, pairs: Tensor, groups: Sequence[Group], heads: int, noise: Noise | None
    ) -> Tensor:
        asking = queries.view(heads, -1, *queries.shape[1:])
        both = pairs.view(2, heads, -1, *pairs.shape[1:])
        result = torch.empty_like(asking)
        ctx.groups, ctx.noise, ctx.seen = groups, noise, []
        for group in groups:
            keys, values = _rows(both, group)
            weights = weigh(asking[:, :, group.queries], keys)
            drawn = None if noise is None else noise.bytes(*weights.shape)
            ctx.seen.append(Seen(weights, drawn))
            torch.sum(
                _kept(weights, drawn, noise).unsqueeze(1) * values.unsqueeze(2),
                3,
                out=result[:, :, group.queries],
            )
        ctx.save_for_backward(asking, both)
        return result.view(queries.shape)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        asking, both = ctx.saved_tensors
        pull = pull.view(asking.shape)
        to_asking, to_both = torch.empty_like(asking), torch.zeros_like(both)
        for group, (weights, drawn) in zip(ctx.groups, ctx.seen, strict=True):
            keys, values = _rows(both, group)
            own, given = asking[:, :, group.queries], pull[:, :, group.queries].unsqueeze(3)
            kept = _kept(weights, drawn, ctx.noise)
            to_keys, to_values = torch.empty_like(keys), torch.empty_like(values)
            torch.sum(kept.unsqueeze(1) * given, 2, out=to_values)
            to_weights = _kept((given * values.unsqueeze(2)).sum(1), drawn, ctx.noise)
            inner = to_weights.mul_(weights)
            scores = torch.addcmul(inner, weights, inner.sum(2, keepdim=True), value=-1.0)
            scores = scores.mul_(own.shape[1] ** -0.5).unsqueeze(1)
            torch.sum(scores * keys.unsqueeze(2), 3, out=to_asking[:, :, group.queries])
            torch.sum(scores * own.unsqueeze(3), 2, out=to_keys)
            for place, found in enumerate((to_keys, to_values)):
                to_both[place].index_add_(2, _index(group, both), found)
        return to_asking.flatten(0, 1), to_both.flatten(0, 2), None, None, None


_attend: Callable[..., Tensor] = _Attend.apply


def _rows(both: Tensor, group: Group) -> tuple[Tensor, ...]:
    """Keys and values ``(heads, size, keys, frames)`` that a group sees."""
    return both.index_select(3, _index(group, both)).unbind(0)


def _index(group: Group, like: Tensor) -> Tensor:
    return torch.tensor(group.keys, device=like.device)


def _kept(values: Tensor, drawn: Tensor | None, noise: Noise | None) -> Tensor:
    return values if drawn is None or noise is None else values * noise.kept(drawn, values)
