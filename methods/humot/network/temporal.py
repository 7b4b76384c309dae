"""Convolutions in time, joint by joint, with zeros beyond the first and the last frame.

A convolution of k taps costs k products per frame. In the frequencies of a stretch of some thirty frames it
costs between two and three, a change of basis included, and that is a small matrix product as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable
from torch.nn import functional

STRETCH = 48
"""Frames that are transformed at once; longer motions are cut."""
FEWEST, NARROWEST = 64, 32
"""Joints and channels below which the convolution is done as it stands."""


class TemporalConvolution(nn.Module):
    """As many frames out as in. inputs, outputs: channels."""

    def __init__(self, inputs: int, outputs: int, kernel: int) -> None:
        super().__init__()
        if kernel % 2 == 0:
            raise ValueError(f"a convolution as long as its input has an odd number of taps, not {kernel}")
        plain = nn.Conv1d(inputs, outputs, kernel)
        assert plain.bias is not None
        self.weight, self.bias = plain.weight, plain.bias
        self.kernel = kernel

    def forward(self, values: Tensor) -> Tensor:
        """``(joints, frames, outputs)`` from ``(joints, frames, inputs)``."""
        joints, frames, inputs = values.shape
        if joints * -(-frames // STRETCH) < FEWEST or inputs < NARROWEST:
            return self._directly(values)
        return self._by_frequency(values)

    def _directly(self, values: Tensor) -> Tensor:
        picture = values.unsqueeze(1).permute(0, 3, 1, 2)
        found = functional.conv2d(
            picture, self.weight.unsqueeze(2), self.bias, padding=(0, self.kernel // 2)
        )
        return found.permute(0, 2, 3, 1).squeeze(1).contiguous()

    def _by_frequency(self, values: Tensor) -> Tensor:
        joints, frames, inputs = values.shape
        reach, count = self.kernel // 2, -(-frames // STRETCH)
        length = -(-frames // count)
        bases = _bases(length, self.kernel, count > 1)
        if count > 1:
            padded = functional.pad(values, (0, 0, reach, reach + count * length - frames))
            windows = padded.unfold(1, length + 2 * reach, length).transpose(2, 3)
            values = windows.reshape(joints * count, -1, inputs)
        there, back, taps = (each.to(values) for each in bases)
        weights = torch.mm(taps, self.weight.permute(2, 1, 0).flatten(1)).view(-1, inputs, len(self.bias))
        found = _multiplied(values, weights, self.bias, there, back)
        if count > 1:
            found = found.view(joints, count * length, -1)[:, :frames]
        return found


class _Multiplied(torch.autograd.Function):
    """Values ``(stretches, frames, inputs)`` to frequencies, times weights there, back, and a bias."""

    @staticmethod
    def forward(
        ctx: Any, values: Tensor, weights: Tensor, bias: Tensor, there: Tensor, back: Tensor
    ) -> Tensor:
        waves = _each(there, values)
        ctx.save_for_backward(waves, weights, there, back)
        return _each(back, _filtered(waves, weights, 1.0)).add_(bias)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, pull: Tensor) -> tuple[Tensor | None, ...]:
        waves, weights, there, back = ctx.saved_tensors
        to_bias = pull.sum((0, 1))
        pull = _each(back.T, pull.contiguous())
        to_weights = torch.empty_like(weights)
        torch.mm(waves[:, 0].T, pull[:, 0], out=to_weights[0])
        (real, imaginary), (left, right) = _parts(waves), _parts(pull)
        half = len(weights) // 2
        cosines, sines = to_weights[1 : half + 1], to_weights[half + 1 :]
        torch.bmm(real.transpose(1, 2), left, out=cosines)
        cosines.baddbmm_(imaginary.transpose(1, 2), right)
        torch.bmm(real.transpose(1, 2), right, out=sines)
        sines.baddbmm_(imaginary.transpose(1, 2), left, alpha=-1.0)
        values = None
        if ctx.needs_input_grad[0]:
            values = _each(there.T, _filtered(pull, weights.transpose(1, 2), -1.0))
        return values, to_weights, to_bias, None, None


_multiplied: Callable[..., Tensor] = _Multiplied.apply


def _each(matrix: Tensor, values: Tensor) -> Tensor:
    """A matrix times each of ``(stretches, frames, channels)``."""
    return torch.bmm(matrix.expand(len(values), *matrix.shape), values)


def _parts(waves: Tensor) -> tuple[Tensor, Tensor]:
    """Cosines and sines of all waves but the constant one, each ``(waves, stretches, channels)``."""
    return waves[:, 1::2].transpose(0, 1), waves[:, 2::2].transpose(0, 1)


def _filtered(waves: Tensor, weights: Tensor, sign: float) -> Tensor:
    """Waves ``(stretches, 1 + 2 n, inputs)`` times complex weights ``(1 + 2 n, inputs, outputs)``.

    The weights hold the constant frequency, then real parts, then imaginary ones; sign -1 conjugates them.
    """
    half = len(weights) // 2
    cosines, sines = weights[1 : half + 1], weights[half + 1 :]
    result = waves.new_empty(*waves.shape[:2], weights.shape[2])
    torch.mm(waves[:, 0], weights[0], out=result[:, 0])
    (real, imaginary), (left, right) = _parts(waves), _parts(result)
    torch.bmm(real, cosines, out=left)
    left.baddbmm_(imaginary, sines, alpha=-sign)
    torch.bmm(real, sines, out=right)
    if sign < 0.0:
        right.neg_()
    right.baddbmm_(imaginary, cosines)
    return result


@lru_cache(maxsize=64)
@torch.inference_mode(False)  # what is kept has to serve where gradients are wanted, too
def _bases(length: int, kernel: int, within: bool) -> tuple[Tensor, Tensor, Tensor]:
    """To waves, back from them, and from taps to weights.

    within: values hold the frames that the kernel reaches before and behind the ``length`` that come out.
    The number of waves is odd, and large enough that what a circle brings round is zero or not read.
    """
    reach = kernel // 2
    count = length + (2 * reach if within else reach)
    count += 1 - count % 2
    steps = torch.arange(1, count // 2 + 1, dtype=torch.float64) * (2.0 * math.pi / count)
    read = torch.arange(length + 2 * reach if within else length, dtype=torch.float64)
    written = torch.arange(length, dtype=torch.float64) + (reach if within else 0)
    offsets = torch.arange(kernel, dtype=torch.float64) - reach

    def waves(times: Tensor, sign: float) -> Tensor:
        angles = steps.unsqueeze(1) * times
        return torch.stack([angles.cos(), sign * angles.sin()])

    one = torch.ones(1, 1, dtype=torch.float64)
    there = torch.cat([one.expand(1, len(read)), waves(read, -1.0).transpose(0, 1).flatten(0, 1)])
    back = torch.cat([one.expand(1, length), 2.0 * waves(written, -1.0).transpose(0, 1).flatten(0, 1)])
    taps = torch.cat([one.expand(1, kernel), waves(offsets, 1.0).flatten(0, 1)])
    return there, (back / count).T.contiguous(), taps
