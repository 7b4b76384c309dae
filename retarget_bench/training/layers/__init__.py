"""Building blocks that several learned methods share: masks, statistics, adversarial training.

Imports torch and ``training.parallel``. Names of parameters and buffers are part of weights files.
"""

from collections.abc import Mapping

from torch import Tensor, nn


def exported(module: nn.Module) -> dict[str, Tensor]:
    """A module's parameters and buffers as copies on the CPU, for a weights file."""
    return {name: each.detach().cpu().clone() for name, each in module.state_dict().items()}


def of_prefix(tensors: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """The tensors named ``prefix.NAME``, by ``NAME``."""
    head = f"{prefix}."
    return {name.removeprefix(head): each for name, each in tensors.items() if name.startswith(head)}
