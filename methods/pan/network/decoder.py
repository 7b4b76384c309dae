"""PAN's motion decoder: codes of parts to edges (section 5.3, eq. 8)."""

from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from ..layout import Layout
from .groups import written
from .layers import EdgeConvolution


class Decoder(nn.Module):
    """Twice: frames doubled by linear interpolation, then a convolution; rectified but for the last time.

    ``full`` reads all parts everywhere, as the paper says. ``parts``: the first convolution stays within
    parts, and the second one reads the parts that an edge is written from. Padding is by reflection, of
    which the paper says nothing.
    """

    def __init__(self, layout: Layout, design: Design) -> None:
        super().__init__()
        count, width, kernel = len(layout.parts), design.width, design.kernel
        self.leak, self.edges = design.leak, layout.edges + 1
        self.reach = ((kernel - 1) // 2, kernel // 2)
        apart = design.decoder == "parts" and design.by_part
        self.inner = nn.Conv1d(count * width, count * width, kernel, groups=count if apart else 1)
        self.outer = (
            EdgeConvolution(written(layout, design), width, kernel)
            if apart
            else nn.Conv1d(count * width, 4 * self.edges, kernel)
        )

    def forward(self, code: Tensor) -> Tensor:
        """``(rows, frames, edges + 1, 4)`` from ``(rows, frames // 4, parts, width)``."""
        hidden = code.flatten(2).transpose(1, 2)
        hidden = functional.leaky_relu(self.inner(self._wider(hidden)), self.leak)
        motion = self.outer(self._wider(hidden))
        return motion.transpose(1, 2).unflatten(2, (self.edges, 4))

    def _wider(self, hidden: Tensor) -> Tensor:
        double = functional.interpolate(hidden, scale_factor=2, mode="linear", align_corners=False)
        return functional.pad(double, self.reach, mode="reflect")
