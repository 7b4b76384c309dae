"""Building blocks that several learned methods share: masks, statistics, adversarial training.

Imports torch and ``training.parallel``. Names of parameters and buffers are part of weights files.
"""

from torch import Tensor, nn


def exported(module: nn.Module) -> dict[str, Tensor]:
    """A module's parameters and buffers as copies on the CPU, for a weights file."""
    return {name: each.detach().cpu().clone() for name, each in module.state_dict().items()}
