"""The plain form of every function with a hand-written backward pass, for tests and measurements.

Each takes what the function takes, gives what it gives, and leaves the gradient to autograd.
"""

from __future__ import annotations

from typing import Any

from torch import Tensor
from torch.nn import functional


def mlp(values: Tensor, activation: str, mask: Any, *weights: Tensor) -> Tensor:
    *inner, last, bias = weights
    for weight, shift in zip(inner[::2], inner[1::2], strict=True):
        values = getattr(functional, activation)(functional.linear(values, weight, shift))
    if mask is not None:
        values = values * mask.factors(mask.bytes(*values.shape), values)
    return functional.linear(values, last, bias)
