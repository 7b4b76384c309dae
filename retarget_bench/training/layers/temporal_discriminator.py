"""NKN's discriminator of windows of motion: convolutions over time on changes from frame to frame.

Beside these changes it sees the bones of the body that should move like that, never poses.
Source: Villegas et al., CVPR 2018, the second architecture of the published code. That the bones enter
the third, fourth and last convolution is the one reading under which it has 280,413 parameters.
"""

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.training.layers.masks import frame_mask

WIDTHS = (32, 64, 128, 256)
KERNEL = 4
LEAK = 0.2


class FrameNorm(nn.Module):
    """Batch normalisation over real frames only, always with the statistics of the batch at hand."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.BatchNorm1d(width, track_running_stats=False)

    def forward(self, hidden: Tensor, real: Tensor) -> Tensor:
        """``(rows, width, frames)`` at real frames ``(rows, frames)``, zero elsewhere.

        A single frame is its own mean: what is left of it is the bias.
        """
        counted = real.unsqueeze(1)
        hidden, count = hidden.float(), real.sum().clamp(min=1)
        mean = (hidden * counted).sum((0, 2), keepdim=True) / count
        apart = (hidden - mean) * counted
        slope = (apart.square().sum((0, 2)) / count + self.norm.eps).rsqrt() * self.norm.weight
        return torch.addcmul(self.norm.bias.unsqueeze(1), apart, slope.unsqueeze(1)) * counted


class TemporalDiscriminator(nn.Module):
    """Convolutions over time of kernel 4 and stride 2, then one of kernel 4 without padding.

    channels: numbers per frame. bones: numbers that describe the body, 0: none. widths: of four layers.
    dropout:  share of input numbers that are dropped while the discriminator itself learns.

    Batch normalisation (second to fourth layer) always takes the statistics of the batch at hand, over
    real frames only. Every layer's output is zero behind a row's last frame, as the zeros of its padding
    are: so neither the rows beside it nor what lies behind it move the score of a row, but through the
    statistics of real frames. 60 frames of motion are 59 differences, then 30, 15, 8, 4 and 1 frame; a
    shorter row is followed by zeros until the last layer has its four frames, of a longer one the mean
    over time is taken.
    """

    def __init__(
        self,
        channels: int = 70,
        bones: int = 63,
        dropout: float = 0.3,
        widths: Sequence[int] = WIDTHS,
    ) -> None:
        super().__init__()
        wide = (channels, *widths)
        self.layers = nn.ModuleList(
            nn.Conv1d(wide[k] + (bones if k > 1 else 0), wide[k + 1], KERNEL, stride=2)
            for k in range(len(widths))
        )
        self.norms = nn.ModuleList(FrameNorm(width) for width in widths[1:])
        self.last = nn.Conv1d(widths[-1] + bones, 1, KERNEL)
        self.dropout = dropout

    def forward(
        self, differences: Tensor, offsets: Tensor, lengths: Tensor | None = None, learns: bool = False
    ) -> Tensor:
        """The logits ``(rows,)`` that rows are real.

        differences: ``(rows, frames, channels)``; what lies behind a row's length is ignored.
        offsets:     ``(rows, bones)`` of each row's body. lengths: ``(rows,)`` differences that are real,
                     at least one; None: all.
        learns:      the discriminator itself is being updated: dropout applies to its input.
        """
        rows, frames, _ = differences.shape
        if lengths is None:
            lengths = torch.full((rows,), frames, device=differences.device)
        hidden = differences.transpose(1, 2)
        if learns:
            hidden = functional.dropout(hidden, self.dropout)
        for number, layer in enumerate(self.layers):
            hidden = self._input(hidden, offsets if number > 1 else None, lengths)
            odd = hidden.shape[-1] % 2
            hidden = layer(functional.pad(hidden, (1, 1 + odd)))
            lengths = (lengths + 1) // 2
            if number > 0:
                hidden = self.norms[number - 1](hidden, frame_mask(lengths, hidden.shape[-1]))
            hidden = functional.leaky_relu(hidden, LEAK)
        hidden = self._input(hidden, offsets, lengths)
        short = max(KERNEL - hidden.shape[-1], 0)
        scores = self.last(functional.pad(hidden, (0, short))).squeeze(1).float()
        counted = (lengths - KERNEL + 1).clamp(min=1)
        return (scores * frame_mask(counted, scores.shape[-1])).sum(-1) / counted

    @staticmethod
    def _input(hidden: Tensor, offsets: Tensor | None, lengths: Tensor) -> Tensor:
        """Input of a layer: its frames, the bones beside each of them, zeros behind the last one."""
        if offsets is not None:
            beside = offsets.unsqueeze(-1).expand(-1, -1, hidden.shape[-1])
            hidden = torch.cat([hidden, beside], dim=1)
        real = frame_mask(lengths, hidden.shape[-1]).unsqueeze(1)
        return torch.where(real, hidden, hidden.new_zeros(()))
