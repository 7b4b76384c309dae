"""What weights of chains of layers start as, which the text does not say.

Chains of four to seven layers stand before and behind the blocks. Started as torch starts layers, each of
them passes on a third of what tells one input from another, most of it in a few directions, and smears it
over nine frames: a code begins by telling nothing, and training stays for long at the pose that is right on
average.
"""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import nn

from .temporal import TemporalConvolution

ELU, RELU = 1.2, 2.0**0.5
"""Gains that make up, about, for what these units take from values around zero."""


def spread(layers: Iterable[nn.Module], gain: float) -> None:
    """Layers begin orthogonal (Saxe et al., 2014), and so that answers vary by ``gain`` times what is put
    in, frame by frame: of a convolution's taps only the one in the middle counts."""
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
