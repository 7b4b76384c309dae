"""The norm between the two convolutions of the local interaction, over real tokens alone."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import torch
from torch import Tensor, nn

from .attention import EPSILON
from .tokens import Lines

MOMENTUM = 0.1


class Inner(nn.Module, ABC):
    """A norm that is part of a longer chain, and so brings its own gradient."""

    weight: nn.Parameter | None
    bias: nn.Parameter | None

    def __init__(self, width: int, affine: bool) -> None:
        super().__init__()
        self.width = width
        self.weight = nn.Parameter(torch.ones(width)) if affine else None
        self.bias = nn.Parameter(torch.zeros(width)) if affine else None

    @abstractmethod
    def applied(
        self, values: Tensor, own: Lines, weight: Tensor | None, bias: Tensor | None
    ) -> tuple[Tensor, tuple[Tensor, ...]]:
        """Values ``(lines, frames, width)``, free to be written to, normalised; what the gradient needs."""

    @abstractmethod
    def pulled(
        self,
        pull: Tensor,
        values: Tensor,
        own: Lines,
        numbers: list[Tensor],
        weight: Tensor | None,
        bias: Tensor | None,
    ) -> tuple[Tensor, Tensor | None, Tensor | None]:
        """Gradients of values, weight and bias; pull is zero where there is nothing."""


class TokenNorm(Inner):
    """Over the channels of each token."""

    def applied(
        self, values: Tensor, own: Lines, weight: Tensor | None, bias: Tensor | None
    ) -> tuple[Tensor, tuple[Tensor, ...]]:
        result, *numbers = torch.native_layer_norm(values, (self.width,), weight, bias, EPSILON)
        return result, tuple(numbers)

    def pulled(self, pull: Tensor, values: Tensor, own: Lines, numbers: list[Tensor], *affine: Any) -> Any:
        weight, bias = affine
        wanted = [True, weight is not None, bias is not None]
        return torch.ops.aten.native_layer_norm_backward(
            pull, values, (self.width,), *numbers, weight, bias, wanted
        )


class BatchNorm(Inner):
    """Over the real tokens of a batch; in evaluation, by means and variances of batches gone by."""

    mean: Tensor
    variance: Tensor

    def __init__(self, width: int, affine: bool) -> None:
        super().__init__(width, affine)
        self.register_buffer("mean", torch.zeros(width))
        self.register_buffer("variance", torch.ones(width))

    def applied(
        self, values: Tensor, own: Lines, weight: Tensor | None, bias: Tensor | None
    ) -> tuple[Tensor, tuple[Tensor, ...]]:
        mean, variance = self._counted(values, own) if self.training else (self.mean, self.variance)
        rate = (variance + EPSILON).rsqrt()
        slope = rate if weight is None else rate * weight
        start = -mean * slope if bias is None else bias - mean * slope
        result = torch.addcmul(start, values, slope)
        return result, (mean.clone(), rate, mean.new_tensor(self.training))

    def pulled(self, pull: Tensor, values: Tensor, own: Lines, numbers: list[Tensor], *affine: Any) -> Any:
        mean, rate, training = numbers
        weight = affine[0]
        slope = rate if weight is None else rate * weight
        total = pull.sum((0, 1))
        along = ((pull * values).sum((0, 1)) - total * mean) * rate
        result = pull * slope
        if training:
            count = own.real.sum()
            turned = -along * rate * slope / count
            result.addcmul_(values, turned).add_(-total * slope / count - mean * turned)
            own.emptied_(result)
        found = (along, total) if weight is not None else (None, None)
        return result, *found

    def _counted(self, values: Tensor, own: Lines) -> tuple[Tensor, Tensor]:
        """Mean and variance of real tokens; the running ones follow."""
        flat, count = own.emptied_(values).flatten(0, 1), own.real.sum()
        mean = flat.sum(0) / count
        missing = len(flat) - count
        variance = ((flat - mean).square().sum(0) - missing * mean.square()).clamp(min=0.0) / count
        with torch.no_grad():
            self.mean.lerp_(mean, MOMENTUM)
            self.variance.lerp_(variance * count / (count - 1.0).clamp(min=1.0), MOMENTUM)
        return mean, variance
