"""An exponential average of the weights, kept beside them while they are trained."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import torch
from torch import Tensor, nn
from torch.optim.swa_utils import get_ema_multi_avg_fn


class WeightAverage:
    """The average of all parameters of modules, on their device; it only observes. Buffers have none.

    After step t the average moves towards the weights by 1 - min(decay, (1 + t) / (10 + t)): early on over
    about the last tenth of the steps, since the initial weights are not worth remembering.
    """

    def __init__(self, modules: nn.Module, decay: float) -> None:
        self._decay = decay
        self._weights = dict(modules.named_parameters())
        self._averages = [each.detach().clone() for each in self._weights.values()]

    @torch.no_grad()
    def update(self, step: int) -> None:
        """Take in the weights after a step, counted from 1. Nothing is copied off the device."""
        decay = min(self._decay, (1.0 + step) / (10.0 + step))
        average = get_ema_multi_avg_fn(decay)  # type: ignore[no-untyped-call]
        average(self._averages, list(self._weights.values()), 0)

    @contextmanager
    def in_place(self) -> Iterator[None]:
        """The modules have the averages for weights. Memory is exchanged, not copied."""
        self._exchange()
        try:
            yield
        finally:
            self._exchange()

    def _exchange(self) -> None:
        for number, weight in enumerate(self._weights.values()):
            weight.data, self._averages[number] = self._averages[number], weight.data

    def state(self) -> dict[str, Tensor]:
        """Parameter -> its average."""
        return dict(zip(self._weights, self._averages, strict=True))

    def restore(self, state: Mapping[str, Tensor]) -> None:
        """Take over what ``state`` gave. Raises KeyError or RuntimeError where it is of other modules."""
        for name, average in zip(self._weights, self._averages, strict=True):
            average.copy_(state[name])
