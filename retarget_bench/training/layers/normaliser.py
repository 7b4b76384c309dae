"""Mean and standard deviation of training data, kept beside a network's weights."""

import numpy as np
import torch
from torch import Tensor, nn


class Normaliser(nn.Module):
    """Subtracts means and divides by deviations, of one or several kinds of numbers.

    Buffers are ``KIND_mean`` and ``KIND_deviation``, each ``(size,)``; 0 and 1 until ``fit``.
    """

    def __init__(self, **sizes: int) -> None:
        super().__init__()
        for kind, size in sizes.items():
            self.register_buffer(f"{kind}_mean", torch.zeros(size))
            self.register_buffer(f"{kind}_deviation", torch.ones(size))

    def fit(self, kind: str, values: np.ndarray, constant: float = 0.0, least: float = 0.0) -> None:
        """Take the statistics of values ``(samples, ...)``; see ``statistics``."""
        flat = values.reshape(len(values), -1)
        for name, value in zip(("mean", "deviation"), statistics(flat, constant, least), strict=True):
            self.get_buffer(f"{kind}_{name}").copy_(torch.from_numpy(value))

    def normalise(self, kind: str, values: Tensor) -> Tensor:
        """Values ``(..., size)`` as deviations from the mean."""
        return (values - self.get_buffer(f"{kind}_mean")) / self.get_buffer(f"{kind}_deviation")

    def restore(self, kind: str, values: Tensor) -> Tensor:
        """The inverse of ``normalise``."""
        return values * self.get_buffer(f"{kind}_deviation") + self.get_buffer(f"{kind}_mean")


def statistics(
    values: np.ndarray, constant: float = 0.0, least: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation over samples ``(samples, ...)``, float64.

    constant: a smaller deviation is taken for that of a constant, and is 1. least: the smallest deviation.
    """
    exact = values.astype(np.float64)
    deviation = exact.std(axis=0)
    return exact.mean(axis=0), np.maximum(np.where(deviation < constant, 1.0, deviation), least)
