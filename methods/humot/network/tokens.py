"""Ragged tokens of a batch: sequences end to end, as tracks of frames, without padded joints.

A track is a joint over time, ``(frames, width)``. A blank track follows those of every sequence, so
that a 3x3 neighbourhood sees zeros beyond the first and the last joint, as it does beyond frames.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from itertools import accumulate

import torch
from torch import Tensor

from ..settings import Design

TOGETHER = 1 << 15
"""Tokens that go through layers of single joints at a time where no gradients are wanted."""


class RaggedTokens:
    """Places of the tracks of each sequence of a batch.

    counts: tracks of each sequence. frames: ``(rows, frames)`` bool, or None where all of them are real;
    padding lies behind.
    """

    def __init__(self, counts: list[int], length: int, frames: Tensor | None, device: torch.device) -> None:
        self.counts, self.length, self.device = counts, length, device
        self.frames = frames
        self.starts = [0, *accumulate(count + 1 for count in counts)]
        self.total = self.starts.pop()

    @classmethod
    def of(cls, joints: Tensor, frames: Tensor, more: int = 0) -> RaggedTokens:
        """Tokens of real joints ``(rows, joints)`` bool, and ``more`` tracks before them."""
        counts = [count + more for count in joints.sum(1).tolist()]
        return cls(counts, frames.shape[1], None if bool(frames.all()) else frames, joints.device)

    def first(self, most: int) -> tuple[RaggedTokens, Tensor]:
        """The first tracks of each sequence alone, and which they are, blank ones included."""
        counts = [min(count, most) for count in self.counts]
        rows = [
            row
            for start, own, count in zip(self.starts, self.counts, counts, strict=True)
            for row in (*range(start, start + count), start + own)
        ]
        return RaggedTokens(counts, self.length, self.frames, self.device), self._index(rows)

    @cached_property
    def leading(self) -> Tensor:
        """The first track of each sequence."""
        return self._index(self.starts)

    def behind(self, skipped: int) -> Tensor:
        """All tracks but blank ones and the first ``skipped`` of each sequence."""
        pairs = zip(self.starts, self.counts, strict=True)
        return self._index([row for start, count in pairs for row in range(start + skipped, start + count)])

    @cached_property
    def blank(self) -> Tensor:
        """The blank tracks."""
        return self._index([start + count for start, count in zip(self.starts, self.counts, strict=True)])

    @cached_property
    def mask(self) -> Tensor | None:
        """``(total, frames, 1)``, 0 where there is nothing; None if that is blank tracks only."""
        if self.frames is None:
            return None
        own = torch.tensor([count + 1 for count in self.counts], device=self.device)
        mask = self.frames.float().repeat_interleave(own, 0).index_fill(0, self.blank, 0.0)
        return mask.unsqueeze(2)

    @cached_property
    def lengths(self) -> list[int]:
        """Frames of each sequence."""
        return [self.length] * len(self.counts) if self.frames is None else self.frames.sum(1).tolist()

    @cached_property
    def real(self) -> Tensor:
        """Numbers of real tokens of each sequence ``(rows,)``, floating."""
        numbers = [count * length for count, length in zip(self.counts, self.lengths, strict=True)]
        return torch.tensor(numbers, dtype=torch.float32, device=self.device)

    def zero_padding_(self, values: Tensor) -> Tensor:
        """Values ``(total, frames, width)`` with zeros, in place, where there is nothing."""
        return values.index_fill_(0, self.blank, 0.0) if self.mask is None else values.mul_(self.mask)

    def over(self, values: Tensor) -> tuple[Tensor, ...]:
        """The tracks of each sequence ``(tracks, frames, width)``, the blank one last."""
        return torch.split(values, [count + 1 for count in self.counts])

    def _index(self, rows: list[int]) -> Tensor:
        return torch.tensor(rows, dtype=torch.long, device=self.device)


def time_code(frames: int, design: Design, like: Tensor) -> Tensor:
    """The code of time ``(frames, width)``: sines in even channels, cosines in odd ones."""
    width, basis = design.width, design.basis
    steps = torch.arange(0, width, 2, dtype=torch.float64)
    angles = torch.arange(frames, dtype=torch.float64).unsqueeze(1) / basis ** (steps / width)
    code = torch.stack([angles.sin(), angles.cos()], -1).flatten(1)[:, :width]
    return design.time * code.to(like)


def in_groups(tokens: Tensor, where: Tensor, made: Callable[[slice], Tensor]) -> Tensor:
    """Tokens with tracks ``where`` replaced by what is ``made`` of a slice of them."""
    if torch.is_grad_enabled():
        return tokens.index_copy_(0, where, made(slice(0, len(where))).to(tokens.dtype))
    step = max(1, TOGETHER // max(tokens.shape[1], 1))
    for start in range(0, len(where), step):
        group = slice(start, start + step)
        tokens[where[group]] = made(group)
    return tokens


def styled(tokens: Tensor, style: Tensor, ragged: RaggedTokens) -> Tensor:
    """Tokens of each sequence times one more than its style ``(rows, frames, width)``."""
    pairs = zip(ragged.over(tokens), style, strict=True)
    return torch.cat([torch.addcmul(own, own, each) for own, each in pairs])
