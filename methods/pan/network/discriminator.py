"""PAN's discriminator of short stretches of motion (section 5.4)."""

from torch import Tensor, nn
from torch.nn import functional

from ..design import Design


class Discriminator(nn.Module):
    """A convolution over time without padding, then two layers on single frames.

    channels: numbers per frame. With ``squashed`` the scores end in a sigmoid (eq. 9). The paper does not
    say how many layers there are: they are the released code's.
    """

    def __init__(self, channels: int, design: Design) -> None:
        super().__init__()
        self.leak, self.squashed = design.leak, design.squashed
        self.layers = nn.ModuleList(
            [
                nn.Conv1d(channels, design.judging, design.kernel),
                nn.Conv1d(design.judging, design.judging // 2, 1),
                nn.Conv1d(design.judging // 2, 1, 1),
            ]
        )

    def forward(self, seen: Tensor) -> Tensor:
        """Scores ``(rows, frames - kernel + 1)`` from ``(rows, frames, channels)``."""
        hidden = seen.transpose(1, 2)
        for layer in self.layers[:-1]:
            hidden = functional.leaky_relu(layer(hidden), self.leak)
        scores: Tensor = self.layers[-1](hidden).squeeze(1)
        return scores.sigmoid() if self.squashed else scores
