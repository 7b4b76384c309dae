"""Answers that were shown to a discriminator, and whether it still has to learn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from retarget_bench.training import parallel

BEATEN, MEMORY = 0.3, 0.99
"""The discriminator learns while its running score of fakes is above the first; the second is the share
of that score that is kept from step to step."""


@dataclass(eq=False)
class Fake:
    """Answers of one group on other bodies, and real clips of these bodies.

    motion, real: ``(rows, frames, channels)`` as the discriminator sees them. bones: ``(rows, ...)``.
    loss, score: sums over rows, of the generator's loss and of the probability to be real.
    """

    structure: int
    bones: Tensor
    motion: Tensor
    lengths: Tensor
    real: Tensor
    real_lengths: Tensor
    loss: Tensor
    score: Tensor


class Scores(nn.Module):
    """Per structure how real its discriminator takes fakes to be, averaged over the last steps."""

    running: Tensor

    def __init__(self, structures: int) -> None:
        super().__init__()
        self.register_buffer("running", torch.full((structures,), 0.5))

    def follow(self, fakes: Sequence[Fake]) -> Tensor:
        """``(structures,)`` bool: whose discriminator learns now. The same on every process."""
        sums = self.running.new_zeros(len(self.running), 2)
        for fake in fakes:
            sums[fake.structure] += torch.stack([fake.score, fake.score.new_tensor(float(len(fake.bones)))])
        total, rows = parallel.mean(sums).unbind(1)
        seen = rows > 0
        new = MEMORY * self.running + (1.0 - MEMORY) * total / rows.clamp(min=1e-6)
        self.running.copy_(torch.where(seen, new, self.running))
        return seen & (self.running > BEATEN)
