"""R2ET's discriminator, PMnet's: convolutions over time on the mean of a body's joints.

Sources: Lim et al., BMVC 2019; Zhang et al., CVPR 2023, and the published code of the latter, whose last
convolution has three taps.
"""

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.training.layers.masks import frame_mask
from retarget_bench.training.layers.temporal_discriminator import LEAK, FrameNorm

WIDTHS = (16, 32, 64, 64)
KERNEL, LAST = 4, 3
"""Taps of all convolutions but the last, and of the last."""


class TrajectoryDiscriminator(nn.Module):
    """Four convolutions of kernel 4 and stride 2, then one of kernel 3 without padding: 60 frames become
    30, 15, 7, 3 and 1. It has 27,505 parameters.

    Batch normalisation takes the statistics of the batch at hand, over real frames only; behind a row's
    last frame every layer reads zeros. A row of fewer frames is followed by zeros until the last layer has
    its three; of a longer one the mean over time is taken.
    dropout: share of input numbers that are dropped while the discriminator itself learns.
    """

    def __init__(self, dropout: float = 0.2) -> None:
        super().__init__()
        wide = (3, *WIDTHS)
        self.layers = nn.ModuleList(
            nn.Conv1d(size, width, KERNEL, stride=2, padding=1)
            for size, width in zip(wide, WIDTHS, strict=False)
        )
        self.norms = nn.ModuleList(FrameNorm(width) for width in WIDTHS[1:])
        self.last = nn.Conv1d(WIDTHS[-1], 1, LAST)
        self.dropout = dropout

    def forward(self, paths: Tensor, lengths: Tensor, learns: bool = False) -> Tensor:
        """The logits ``(rows,)`` that rows are real.

        paths: ``(rows, frames, 3)``; what lies behind a row's length ``(rows,)`` is ignored.
        """
        hidden = paths.transpose(1, 2)
        if learns:
            hidden = functional.dropout(hidden, self.dropout)
        for number, layer in enumerate(self.layers):
            hidden = layer(_real(hidden, lengths))
            lengths = (lengths // 2).clamp(min=1)
            if number > 0:
                hidden = self.norms[number - 1](hidden, frame_mask(lengths, hidden.shape[-1]))
            hidden = functional.leaky_relu(hidden, LEAK)
        short = max(LAST - hidden.shape[-1], 0)
        scores = self.last(functional.pad(_real(hidden, lengths), (0, short))).squeeze(1).float()
        counted = (lengths - LAST + 1).clamp(min=1)
        return (scores * frame_mask(counted, scores.shape[-1])).sum(-1) / counted


def _real(hidden: Tensor, lengths: Tensor) -> Tensor:
    """``(rows, width, frames)`` with zeros behind each row's last frame, and two frames at least."""
    real = frame_mask(lengths, hidden.shape[-1]).unsqueeze(1)
    masked = torch.where(real, hidden, hidden.new_zeros(()))
    return functional.pad(masked, (0, max(2 - hidden.shape[-1], 0)))
