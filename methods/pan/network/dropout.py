"""Dropout that costs little: a byte of noise decides for an element, not a drawn and compared float."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

LEVELS = 256
"""Shares are rounded to one of so many; what stays is scaled up by just what was left out."""


class Noise:
    """Bytes for one pass through a network, from a seed that torch's generator gives.

    share: of what is left out. Torch's own way takes some fifteen times as long on a processor.
    """

    def __init__(self, share: float, device: torch.device) -> None:
        self.limit = round(share * LEVELS)
        self.scale = LEVELS / (LEVELS - self.limit)
        self.device = device
        if device.type == "cpu":
            seed = int(torch.randint(2**62, ()))
            self.generator = np.random.Generator(np.random.SFC64(seed))

    def bytes(self, *shape: int) -> Tensor:
        """uint8."""
        if self.device.type != "cpu":
            return torch.randint(LEVELS, shape, dtype=torch.uint8, device=self.device)
        count = int(np.prod(shape))
        words = self.generator.integers(0, 2**64, -(-count // 8), dtype=np.uint64)
        return torch.from_numpy(words).view(torch.uint8)[:count].view(shape)

    def kept(self, drawn: Tensor, like: Tensor) -> Tensor:
        """What elements are multiplied by: 0, or a little more than 1."""
        return torch.ge(drawn, self.limit, out=torch.empty_like(like)).mul_(self.scale)


def dropped(values: Tensor, noise: Noise | None) -> Tensor:
    """Values behind dropout."""
    return values if noise is None else values * noise.kept(noise.bytes(*values.shape), values)
