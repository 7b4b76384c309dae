"""Which joint is which, by places in the neutral pose: how near each of them is to anchors that are learnt.

With the arms along the body a wrist is beside a thigh, and networks that read coordinates take long to tell
the two apart. An anchor per channel says it from the first step.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

EXTENT = (0.7, 0.3, 1.7)
"""Metres across, through and up that anchors lie in at first: those of a person in the neutral pose."""
BELOW = 0.1
"""Metres from the hips down to the middle of that."""
SHARPNESS = 2.0
"""Of anchors at first: the logarithm of one over the metres that are far, 0.14."""


class Anchors(nn.Module):
    """places: ``(width, 3)`` metres, Z up, from the hips. sharpness: ``(width,)``."""

    def __init__(self, width: int) -> None:
        super().__init__()
        spread = torch.rand(width, 3) - 0.5
        self.places = nn.Parameter(spread * torch.tensor(EXTENT) - torch.tensor([0.0, 0.0, BELOW]))
        self.sharpness = nn.Parameter(torch.full((width,), SHARPNESS))

    def forward(self, template: Tensor) -> Tensor:
        """``(joints, width)`` minus squared distances of ``(joints, 3)``, in units of each anchor."""
        squares = (template.unsqueeze(1) - self.places).square().sum(2)
        return -squares * (2.0 * self.sharpness).exp()
