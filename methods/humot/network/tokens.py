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
from torch.nn import functional

from ..design import Design

PIECE = 512
"""Tokens that go through a chain of layers at a time on a processor: what is between them stays cached."""
TOGETHER = 1 << 15
"""Tokens that go through layers of single joints at a time where no gradients are wanted."""


class RaggedTokens:
    """Where the tracks of each sequence of a batch lie.

    counts: tracks of each sequence. frames: ``(rows, frames)`` bool, or None where all of them are real;
    padding lies behind.
    """

    def __init__(self, counts: list[int], length: int, frames: Tensor | None, device: torch.device) -> None:
        self.counts, self.length, self.device = counts, length, device
        self.frames = frames
        self.starts = [0, *accumulate(count + 1 for count in counts)]
        self.total = self.starts.pop()
        self.even = len(set(counts)) == 1

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
    def slices(self) -> list[slice]:
        """The tokens of each sequence."""
        pairs = zip(self.starts, self.counts, strict=True)
        return [slice(start * self.length, (start + count) * self.length) for start, count in pairs]

    @cached_property
    def pieces(self) -> list[slice]:
        """All tokens but blank ones, some at a time; all at once on an accelerator."""
        if self.device.type != "cpu":
            return [slice(0, self.total * self.length)]
        return [piece for each in self.slices for piece in pieces_of(each)]

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

    def shorter_than(self, limit: int) -> list[int]:
        """The numbers of sequences with fewer real tokens than that."""
        pairs = zip(self.counts, self.lengths, strict=True)
        return [number for number, (count, length) in enumerate(pairs) if count * length < limit]

    def sequence(self, values: Tensor, number: int) -> Tensor:
        """The real tokens of one sequence ``(tracks, frames, width)``."""
        start = self.starts[number]
        return values[start : start + self.counts[number], : self.lengths[number]]

    def zero_padding_(self, values: Tensor) -> Tensor:
        """Values ``(total, frames, width)`` with zeros, in place, where there is nothing."""
        return values.index_fill_(0, self.blank, 0.0) if self.mask is None else values.mul_(self.mask)

    def products(self, left: Tensor, right: Tensor) -> Tensor:
        """Sum of outer products over the tokens of each sequence ``(rows, lefts, rights)``."""
        if self.even:
            left, right = self._batch(left), self._batch(right)
            return torch.bmm(left.transpose(1, 2), right)
        result = left.new_empty(len(self.counts), left.shape[-1], right.shape[-1])
        left, right = left.flatten(0, 1), right.flatten(0, 1)
        for own, found in zip(self.slices, result, strict=True):
            torch.mm(left[own].T, right[own], out=found)
        return result

    def mixed(self, values: Tensor, matrices: Tensor, plus: Tensor | None = None) -> Tensor:
        """Tokens times the matrix ``(rows, width, width)`` of their sequence, and what is in plus."""
        plus = torch.zeros_like(values) if plus is None else plus
        if self.even:
            return torch.baddbmm(self._batch(plus), self._batch(values), matrices).view_as(values)
        result = torch.empty_like(plus)
        result[self.blank] = plus[self.blank]
        flat, values, plus = result.flatten(0, 1), values.flatten(0, 1), plus.flatten(0, 1)
        for own, matrix in zip(self.slices, matrices, strict=True):
            torch.addmm(plus[own], values[own], matrix, out=flat[own])
        return result

    def added_(self, values: Tensor, vectors: Tensor) -> Tensor:
        """Values with the vector ``(rows, width)`` of their sequence added, in place."""
        if self.even:
            self._batch(values).add_(vectors.unsqueeze(1))
            return values
        for own, vector in zip(self.over(values), vectors, strict=True):
            own += vector
        return values

    def sums(self, values: Tensor) -> Tensor:
        """Sums of each sequence's values ``(rows, width)``; they are zero on blank tracks."""
        if self.even:
            return self._batch(values).sum(1)
        flat = values.flatten(0, 1)
        return torch.stack([flat[own].sum(0) for own in self.slices])

    def over(self, values: Tensor) -> list[Tensor]:
        """The values of each sequence ``(tracks, frames, width)``."""
        pairs = zip(self.starts, self.counts, strict=True)
        return [values[start : start + count] for start, count in pairs]

    def joined(self, parts: list[Tensor]) -> Tensor:
        """All tracks from those of each sequence; blank ones are zero."""
        blank = parts[0].new_zeros(1, *parts[0].shape[1:])
        return torch.cat([each for part in parts for each in (part, blank)])

    def _batch(self, values: Tensor) -> Tensor:
        return values.view(len(self.counts), -1, values.shape[-1])

    def _index(self, rows: list[int]) -> Tensor:
        return torch.tensor(rows, dtype=torch.long, device=self.device)


def pieces_of(tokens: slice) -> list[slice]:
    """Slices of about one size."""
    count = tokens.stop - tokens.start
    step = -(-count // max(1, -(-count // PIECE)))
    return [slice(k, min(k + step, tokens.stop)) for k in range(tokens.start, tokens.stop, max(step, 1))]


def time_code(frames: int, design: Design, like: Tensor) -> Tensor:
    """The code of time ``(frames, width)``: sines in even channels, cosines in odd ones."""
    width, basis = design.width, design.basis
    steps = torch.arange(0, width, 2, dtype=torch.float64)
    angles = torch.arange(frames, dtype=torch.float64).unsqueeze(1) / basis ** (steps / width)
    code = torch.stack([angles.sin(), angles.cos()], -1).flatten(1)[:, :width]
    return design.time * code.to(like)


def as_image(values: Tensor) -> Tensor:
    """Tracks ``(tracks, frames, width)`` as torch's convolutions see them, without a copy."""
    return values.unsqueeze(0).permute(0, 3, 1, 2)


def from_image(picture: Tensor) -> Tensor:
    """The inverse of ``as_image``."""
    return picture.permute(0, 2, 3, 1).squeeze(0).contiguous()


def elu_(values: Tensor) -> Tensor:
    """The exponential linear unit, in place."""
    return functional.elu(values, inplace=True)


def in_groups(tokens: Tensor, where: Tensor, made: Callable[[slice], Tensor]) -> Tensor:
    """Tokens with tracks ``where`` replaced by what is ``made`` of a slice of them."""
    if torch.is_grad_enabled():
        return tokens.index_copy_(0, where, made(slice(0, len(where))))
    step = max(1, TOGETHER // max(tokens.shape[1], 1))
    for start in range(0, len(where), step):
        group = slice(start, start + step)
        tokens[where[group]] = made(group)
    return tokens


def styled(tokens: Tensor, style: Tensor, ragged: RaggedTokens) -> Tensor:
    """Tokens of each sequence times one more than its style ``(rows, frames, width)``."""
    pairs = zip(ragged.over(tokens), style, strict=True)
    return ragged.joined([torch.addcmul(own, own, each) for own, each in pairs])
