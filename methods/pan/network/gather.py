"""Rows put in other orders, and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable


class Table(nn.Module):
    """Pieces that each read some of ``count`` rows; -1 reads anything at all.

    What pieces read with -1 must not matter, and the gradient of a row that nobody reads must not either:
    neither is zeroed.
    """

    back: Tensor
    again: Tensor
    more: Tensor

    def __init__(self, pieces: Sequence[Sequence[int]], count: int) -> None:
        super().__init__()
        for number, piece in enumerate(pieces):
            index = torch.tensor(piece).clamp_(min=0)
            self.register_buffer(f"piece{number}", index, persistent=False)
        self.count = len(pieces)
        first: dict[int, int] = {}
        others = [
            (row, place)
            for place, row in enumerate(chain(*pieces))
            if row >= 0 and first.setdefault(row, place) != place
        ]
        again, more = zip(*others, strict=True) if others else ((), ())
        back = [first.get(row, 0) for row in range(count)]
        for name, values in (("back", back), ("again", again), ("more", more)):
            self.register_buffer(name, torch.tensor(values, dtype=torch.long), persistent=False)

    def forward(self, values: Tensor) -> tuple[Tensor, ...]:
        """Each piece ``(frames, of the piece, size)`` from ``(frames, count, size)``."""
        pieces = [self.get_buffer(f"piece{number}") for number in range(self.count)]
        return _gather(values, self.back, self.again, self.more, *pieces)


class _Gather(torch.autograd.Function):
    """Gradients are gathered too, but for rows read more than once: adding all takes longer."""

    @staticmethod
    def forward(
        ctx: Any, values: Tensor, back: Tensor, again: Tensor, more: Tensor, *pieces: Tensor
    ) -> tuple[Tensor, ...]:
        ctx.save_for_backward(back, again, more)
        return tuple(values.index_select(1, piece) for piece in pieces)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *pulls: Tensor) -> tuple[Tensor | None, ...]:
        back, again, more = ctx.saved_tensors
        pull = torch.cat(pulls, 1) if len(pulls) > 1 else pulls[0]
        found = pull.index_select(1, back)
        if len(again):
            found.index_add_(1, again, pull.index_select(1, more))
        return (found, None, None, None, *(None for _ in pulls))


_gather: Callable[..., tuple[Tensor, ...]] = _Gather.apply
