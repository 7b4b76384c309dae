"""What weights of chains of layers start as, which the text does not say.

Chains of four to seven layers stand before and behind the blocks. Started as torch starts layers, each of
them passes on a third of what tells one input from another, and smears it over nine frames: a code begins
by telling nothing, and training stays for long at the pose that is right on average.
"""

from __future__ import annotations

from collections.abc import Iterable

from torch import nn

from .temporal import TemporalConvolution

ELU, RELU = 1.2, 2.0**0.5
"""Gains that make up, about, for what these units take from values around zero."""


def spread(layers: Iterable[nn.Module], gain: float) -> None:
    """Layers begin so that answers vary by ``gain`` times what is put in (He et al., 2015, eq. 10), frame
    by frame: of a convolution's taps only the one in the middle counts."""
    for layer in layers:
        assert isinstance(layer, nn.Linear | TemporalConvolution)
        nn.init.normal_(layer.weight, std=gain / layer.weight.shape[1] ** 0.5)
        if isinstance(layer, TemporalConvolution):
            middle = layer.kernel // 2
            nn.init.zeros_(layer.weight[..., :middle])
            nn.init.zeros_(layer.weight[..., middle + 1 :])
        if layer.bias is not None:
            nn.init.zeros_(layer.bias)
