"""Discriminators by structure, and their least-squares loss with a replay buffer of answers."""

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor, nn

from retarget_bench.training.contract import Terms
from retarget_bench.training.layers.adversarial import ReplayBuffer, least_squares

REPLAYED = 50
"""Answers in a replay buffer (published code of SAN and PAN)."""


def discriminator_loss(real: Tensor, answers: Tensor) -> Tensor:
    """The discriminator's part of PAN's eq. 12, in the direction of LSGAN: real is 1, an answer is 0."""
    return 0.5 * (least_squares(real, True) + least_squares(answers, False))


class Discriminators(nn.Module):
    """One discriminator for each structure, with its replay buffer of answers.

    networks: by structure. replayed: structure -> shape of an answer, where it has a replay buffer.
    summed: losses of structures are added up, instead of their mean.
    """

    def __init__(
        self,
        networks: Mapping[str, nn.Module],
        replayed: Mapping[str, tuple[int, ...]],
        summed: bool = True,
    ) -> None:
        super().__init__()
        self.summed = summed
        self.discriminators = nn.ModuleDict(networks)
        self.pools = nn.ModuleDict(
            {name: ReplayBuffer(REPLAYED, *shape) for name, shape in replayed.items()}
        )

    def adversarial_loss(self, name: str, answers: Tensor) -> Tensor:
        """The generator's part of PAN's eq. 12, for answers ``(rows, frames, ...)``."""
        return least_squares(self.discriminators[name](answers), True)

    def loss(self, shown: Sequence[tuple[str, Tensor, Tensor]]) -> Terms:
        """The mean of ``discriminator_loss`` over structures, or the sum.

        shown: structure, real motion, answers. The term has the name that logs and cards have.
        """
        losses = []
        for name, real, answers in shown:
            if name in self.pools:
                answers = self.pools[name](answers)
            discriminator = self.discriminators[name]
            losses.append(discriminator_loss(discriminator(real), discriminator(answers)))
        if not losses:
            return {}
        names = {name for name, _, _ in shown}
        unused = [each for name, each in self.discriminators.items() if name not in names]
        # processes that train together need a gradient of every parameter
        idle = [0.0 * parameter.sum() for each in unused for parameter in each.parameters()]
        total = torch.stack(losses).sum() if self.summed else torch.stack(losses).mean()
        return {"told_apart": total + (torch.stack(idle).sum() if idle else 0.0)}
