"""Ragged tokens of a batch: sequences end to end, as tracks of frames, without padded joints.

A track is a joint over time, ``(frames, width)``. A blank track follows those of every sequence, so
that a 3x3 neighbourhood sees zeros beyond the first and the last joint, as it does beyond frames.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from ..settings import Design

TOGETHER = 1 << 15
"""Tokens that go through layers of single joints at a time where no gradients are needed."""
HALO = 2
"""The reach of the two convolutions of a block's local interaction."""


class RaggedTokens(NamedTuple):
    """The positions of the tracks of each sequence of a batch; made on the CPU beside the batch, moved with
    it.

    counts:  tracks of each sequence, without the blank one. lengths: frames of each sequence.
    length:  frames of a track, padding included.
    rows, joints: ``(real,)`` indices of the real ones among padded joints ``(rows, joints)``.
    own:     ``(real,)`` their tracks.
    leading, blank: ``(rows,)`` the first track and the blank one of each sequence.
    frames:  ``(rows, frames)`` bool, or None where all of them are real; padding lies behind.
    mask:    ``(total, frames, 1)``, 0 where there is nothing; None if that is blank tracks only.
    real:    ``(rows,)`` numbers of real tokens, floating.
    near:    the latent track of each sequence with the tracks that it depends on in a block, as a batch of
             their own, and ``(tracks,)`` which they are; None where there are no latent tracks.
    """

    counts: tuple[int, ...]
    lengths: tuple[int, ...]
    length: int
    rows: Tensor
    joints: Tensor
    own: Tensor
    leading: Tensor
    blank: Tensor
    frames: Tensor | None
    mask: Tensor | None
    real: Tensor
    near: tuple[RaggedTokens, Tensor] | None = None

    @classmethod
    def of(cls, joints: np.ndarray, frames: np.ndarray, more: int = 0) -> RaggedTokens:
        """Tokens of real joints ``(rows, joints)`` bool in real frames ``(rows, frames)`` bool.

        more: tracks before them."""
        rows, places = np.nonzero(joints)
        counts, lengths = joints.sum(1) + more, frames.sum(1)
        blank = np.cumsum(counts + 1) - 1
        padded = not frames.all()
        mask = np.repeat(frames, counts + 1, axis=0).astype(np.float32)[..., None]
        mask[blank] = 0.0
        return cls(
            counts=tuple(counts.tolist()),
            lengths=tuple(lengths.tolist()),
            length=frames.shape[1],
            rows=torch.from_numpy(rows),
            joints=torch.from_numpy(places),
            own=torch.from_numpy(np.arange(len(rows)) + (1 + more) * rows + more),
            leading=torch.from_numpy(blank - counts),
            blank=torch.from_numpy(blank),
            frames=torch.from_numpy(frames) if padded else None,
            mask=torch.from_numpy(mask) if padded else None,
            real=torch.from_numpy((counts * lengths).astype(np.float32)),
        )

    @classmethod
    def with_latent(cls, joints: np.ndarray, frames: np.ndarray) -> RaggedTokens:
        """The same, with a latent track before the joints' ones."""
        extended = cls.of(joints, frames, 1)
        near = cls.of(joints & (joints.cumsum(1) <= HALO), frames, 1)
        which = np.arange(near.total)
        which += np.repeat((extended.leading - near.leading).numpy(), np.array(near.counts) + 1)
        which[near.blank.numpy()] = extended.blank.numpy()
        return extended._replace(near=(near, torch.from_numpy(which)))

    @classmethod
    def between(
        cls, source: np.ndarray, target: np.ndarray, frames: np.ndarray
    ) -> tuple[RaggedTokens, RaggedTokens]:
        """The tokens of encoder and decoder, by the joints of both."""
        return cls.with_latent(source, frames), cls.of(target, frames)

    @property
    def total(self) -> int:
        """Tracks of all sequences, blank ones included."""
        return sum(self.counts) + len(self.counts)

    @property
    def first(self) -> Tensor:
        """The first track and the blank one of each sequence, in turn."""
        return torch.stack([self.leading, self.blank], 1).flatten()

    def zero_padding_(self, values: Tensor) -> Tensor:
        """Values ``(total, frames, width)`` with zeros, in place, where there is nothing."""
        return values.index_fill_(0, self.blank, 0.0) if self.mask is None else values.mul_(self.mask)

    def over(self, values: Tensor) -> tuple[Tensor, ...]:
        """The tracks of each sequence ``(tracks, frames, width)``, the blank one last."""
        return torch.split(values, [count + 1 for count in self.counts])


def time_code(frames: int, design: Design, like: Tensor) -> Tensor:
    """The code of time ``(frames, width)``: sines in even channels, cosines in odd ones."""
    width, basis = design.width, design.basis
    steps = torch.arange(0, width, 2, dtype=torch.float64, device=like.device)
    times = torch.arange(frames, dtype=torch.float64, device=like.device)
    angles = times.unsqueeze(1) / basis ** (steps / width)
    code = torch.stack([angles.sin(), angles.cos()], -1).flatten(1)[:, :width]
    return design.time * code.to(like)


def in_groups(tokens: Tensor, where: Tensor, compute: Callable[[slice], Tensor]) -> Tensor:
    """Tokens with tracks ``where`` replaced by what is ``compute`` of a slice of them."""
    if torch.is_grad_enabled():
        return tokens.index_copy_(0, where, compute(slice(0, len(where))).to(tokens.dtype))
    step = max(1, TOGETHER // max(tokens.shape[1], 1))
    for start in range(0, len(where), step):
        group = slice(start, start + step)
        tokens[where[group]] = compute(group)
    return tokens


def styled(tokens: Tensor, style: Tensor, ragged: RaggedTokens) -> Tensor:
    """Tokens of each sequence times one more than its style ``(rows, frames, width)``."""
    pairs = zip(ragged.over(tokens), style, strict=True)
    return torch.cat([torch.addcmul(own, own, each) for own, each in pairs])
