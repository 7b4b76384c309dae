"""Building blocks that several learned methods share: masks, statistics, adversarial training.

What several plug-ins need stands here, since they do not import each other: in ``skeletal`` what methods
with networks for every structure share (SAN, PAN), in ``kinematic`` what methods of joint positions and
movements do (NKN, PMnet). Names of parameters and buffers are part of weights files.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Tensor, nn


def exported(module: nn.Module) -> dict[str, Tensor]:
    """A module's parameters and buffers as copies on the CPU, for a weights file."""
    return {name: each.detach().cpu().clone() for name, each in module.state_dict().items()}
