"""Convolutions in time, joint by joint, with zeros beyond the first and the last frame.

A convolution of k taps costs k products per frame. In the frequencies of a stretch of some thirty frames it
costs between two and three, a change of basis included, and that is a small matrix product as well.
"""

import math
from collections.abc import Iterable
from functools import lru_cache

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..settings import Design
from .block import EPSILON
from .tokens import RaggedTokens

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
        convolved = functional.conv2d(
            picture, self.weight.unsqueeze(2), self.bias, padding=(0, self.kernel // 2)
        )
        return convolved.permute(0, 2, 3, 1).squeeze(1).contiguous()

    def _by_frequency(self, values: Tensor) -> Tensor:
        joints, frames, inputs = values.shape
        reach, count = self.kernel // 2, -(-frames // STRETCH)
        length = -(-frames // count)
        there, back, taps = _bases(length, self.kernel, count > 1, values.dtype, values.device)
        if count > 1:
            padded = functional.pad(values, (0, 0, reach, reach + count * length - frames))
            windows = padded.unfold(1, length + 2 * reach, length).transpose(2, 3)
            values = windows.reshape(joints * count, -1, inputs)
        weights = torch.mm(taps, self.weight.permute(2, 1, 0).flatten(1)).view(-1, inputs, len(self.bias))
        convolved = _multiplied(values, weights, self.bias, there, back)
        if count > 1:
            convolved = convolved.view(joints, count * length, -1)[:, :frames]
        return convolved


def _multiplied(values: Tensor, weights: Tensor, bias: Tensor, there: Tensor, back: Tensor) -> Tensor:
    """Values ``(stretches, frames, inputs)`` to frequencies, times weights there, back, and a bias.

    The complex weights ``(1 + 2 n, inputs, outputs)`` hold the constant frequency, then real parts, then
    imaginary ones; waves hold the constant one, then cosine and sine in turn.
    """
    waves = torch.matmul(there, values)
    half = len(weights) // 2
    cosines, sines = weights[1 : half + 1], weights[half + 1 :]
    real, imaginary = (waves[:, start::2].transpose(0, 1) for start in (1, 2))
    constant = torch.mm(waves[:, 0], weights[0])
    left = torch.baddbmm(torch.bmm(real, cosines), imaginary, sines, alpha=-1.0)
    right = torch.baddbmm(torch.bmm(real, sines), imaginary, cosines)
    others = torch.stack([left, right], 1).flatten(0, 1).transpose(0, 1)
    return torch.matmul(back, torch.cat([constant.unsqueeze(1), others], 1)) + bias


@lru_cache(maxsize=64)
@torch.inference_mode(False)  # what is kept has to serve where gradients are wanted, too
def _bases(
    length: int, kernel: int, within: bool, dtype: torch.dtype, device: torch.device
) -> tuple[Tensor, ...]:
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
    return tuple(each.to(device, dtype) for each in (there, (back / count).T.contiguous(), taps))


ELU, RELU = 1.2, 2.0**0.5
"""Gains that make up, about, for what these units take from values around zero."""


def initialise_orthogonal(layers: Iterable[nn.Module], gain: float) -> None:
    """Initialise layers with orthogonal matrices (Saxe et al., 2014), so that outputs vary by ``gain``
    times the inputs, frame by frame: only the middle tap of a convolution is not zero."""
    for layer in layers:
        assert isinstance(layer, nn.Linear | TemporalConvolution)
        outputs, inputs = layer.weight.shape[:2]
        matrix = torch.empty(outputs, inputs)
        nn.init.orthogonal_(matrix, gain * max(1.0, outputs / inputs) ** 0.5)
        with torch.no_grad():
            if isinstance(layer, TemporalConvolution):
                layer.weight.zero_()
                layer.weight[..., layer.kernel // 2] = matrix
            else:
                layer.weight.copy_(matrix)
        nn.init.zeros_(layer.bias)


EXTENT = (0.7, 0.3, 1.7)
"""Metres across, through and up that anchors lie in at first: those of a person in the neutral pose."""
BELOW = 0.1
"""Metres from the hips down to the middle of that."""
SHARPNESS = 2.0
"""Of anchors at first: the logarithm of one over the metres that are far, 0.14."""


class Anchors(nn.Module):
    """places: ``(width, 3)`` metres, Z up, from the hips. sharpness: ``(width,)``."""

    def __init__(self, width: int) -> None:
        super().__init__()
        uniform = torch.rand(width, 3) - 0.5
        self.places = nn.Parameter(uniform * torch.tensor(EXTENT) - torch.tensor([0.0, 0.0, BELOW]))
        self.sharpness = nn.Parameter(torch.full((width,), SHARPNESS))

    def forward(self, template: Tensor) -> Tensor:
        """``(joints, width)`` minus squared distances of ``(joints, 3)``, in units of each anchor."""
        squares = (template.unsqueeze(1) - self.places).square().sum(2)
        return -squares * (2.0 * self.sharpness).exp()


class FrameMean(nn.Module):
    """Adds to every token a linear layer of its frame's weighted mean."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        width = design.width
        self.norm = nn.LayerNorm(width, EPSILON)
        self.anchors = Anchors(width)
        self.mean = nn.LayerNorm(width, EPSILON)
        self.told = nn.Linear(width, width)
        initialise_orthogonal([self.told], 1.0)

    def forward(self, tokens: Tensor, template: Tensor, ragged: RaggedTokens) -> Tensor:
        """``(tracks, frames, width)``. template: ``(joints, 3)`` metres, of all sequences."""
        counts = [count - 1 for count in ragged.counts]
        shares = [each.softmax(0) for each in torch.split(self.anchors(template), counts)]
        pairs = zip(ragged.over(self.norm(tokens)), shares, strict=True)
        means = torch.stack([torch.einsum("jfw,jw->fw", own[1:-1], each) for own, each in pairs])
        summary = self.told(self.mean(means))
        return torch.cat([own + each for own, each in zip(ragged.over(tokens), summary, strict=True)])
