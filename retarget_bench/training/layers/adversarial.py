"""Adversarial training: losses of logits and scores, when a discriminator learns, and older answers."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.training import parallel

START = 0.5
"""The running score before the first step."""


def cross_entropy(logits: Tensor, real: bool) -> Tensor:
    """Binary cross-entropy of each logit against one label; for the generator the non-saturating loss."""
    return functional.softplus(-logits if real else logits)


def least_squares(scores: Tensor, real: bool) -> Tensor:
    """Mean squared distance of scores from their label, 1 or 0 (LSGAN, Mao et al., ICCV 2017)."""
    return functional.mse_loss(scores, torch.full_like(scores, float(real)))


class NknUpdateRule(nn.Module):
    """Lets discriminators learn only while they take enough answers for real.

    As in the published code of NKN (Villegas et al., CVPR 2018): ``running`` ``(discriminators,)`` is a
    moving average of the probability that answers are real, with ``memory`` the share that stays in a step;
    a discriminator learns while its average is above ``threshold``. PAN's discriminators have no
    such rule: they learn in every step.
    """

    running: Tensor

    def __init__(self, discriminators: int = 1, threshold: float = 0.3, memory: float = 0.99) -> None:
        super().__init__()
        self.threshold, self.memory = threshold, memory
        self.register_buffer("running", torch.full((discriminators,), START))

    def update(self, logits: list[tuple[int, Tensor]]) -> list[bool]:
        """For each discriminator whether it learns in this step, the same on every process; this waits for
        a GPU, once.

        logits: discriminator and its ``(rows,)`` of answers; one that has seen none does not learn.
        """
        sums = self.running.new_zeros(len(self.running), 2)
        for number, each in logits:
            sums[number, 0] += each.detach().float().sigmoid().sum()
            sums[number, 1] += len(each)
        total, rows = parallel.mean(sums).unbind(1)
        present = rows > 0
        now = total / rows.clamp(min=1e-6)
        new = self.memory * self.running + (1.0 - self.memory) * now
        self.running.copy_(torch.where(present, new, self.running))
        learns: list[bool] = (present & (self.running > self.threshold)).tolist()
        return learns


class ReplayBuffer(nn.Module):
    """The last answers, mixed into those that a discriminator learns from.

    Each new answer is kept with probability one half, else it takes the place of an older one, which the
    discriminator sees instead (Shrivastava et al., CVPR 2017).
    """

    kept: Tensor
    count: Tensor

    def __init__(self, size: int, *shape: int) -> None:
        super().__init__()
        self.register_buffer("kept", torch.zeros(size, *shape))
        self.register_buffer("count", torch.tensor(0))
        self._count, self._full = 0, False

    def forward(self, answers: Tensor) -> Tensor:
        """``(rows, *shape)`` new and older answers. Random numbers are drawn on the CPU, so that
        training on a GPU sees the same ones."""
        size, rows = len(self.kept), len(answers)
        if not self._full:  # asking a GPU waits for it
            self._count = int(self.count)
            self._full = self._count == size
        new, places = torch.rand(rows) < 0.5, torch.randint(size, (rows,))
        buffered, mixed = list(range(size)), list(range(size, size + rows))  # rows of buffer and answers
        for row, (keep, place) in enumerate(zip(new.tolist(), places.tolist(), strict=True)):
            if self._count < size:
                buffered[self._count] = size + row
                self._count += 1
            elif not keep:
                mixed[row], buffered[place] = buffered[place], size + row
        every = torch.cat([self.kept, answers.to(self.kept.dtype)])
        index = torch.tensor(buffered + mixed)
        index = (index.pin_memory() if answers.is_cuda else index).to(answers.device, non_blocking=True)
        self.kept.copy_(every[index[:size]])
        if not self._full:
            self.count.fill_(self._count)
        return every[index[size:]]
