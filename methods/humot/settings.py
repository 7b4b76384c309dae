"""HuMoT's parameters, and the sizes of its networks, whose variants are in ``variants.toml``."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from retarget_bench.errors import BenchError
from retarget_bench.motion import root_rules
from retarget_bench.training import variants

Variant = Literal["small", "text", "paper_count"]
Norm = Literal["batch", "layer"]
Windows = Literal["overlapping", "whole"]
Split = Literal["clip", "chunk"]


@dataclass(frozen=True)
class Design:
    """Sizes and forms of the networks.

    width:     channels of a token. latent: numbers of the code, per frame. heads: of attention; they divide
               the width.
    blocks:    in the encoder and in the decoder.
    template:  hidden widths of both MLPs on templates. motion: widths of the convolutions on positions;
               the last one is also that of the linear layers behind them and of the encoder's template.
    kernel:    taps of all convolutions in time, odd; the text does not say how many.
    joined:    linear layers behind the convolutions on positions. written: those behind the decoder's.
    expansion: hidden width of the feed-forward layers, in widths.
    biased:    queries, keys and values have biases.
    norm:      between the two convolutions of the local interaction: ``batch`` over all real tokens of a
               batch, as XCiT does, or ``layer``, over a token's own channels: then training on a sequence
               does not depend on its neighbours. affine: it has a scale and a shift.
    scale:     what the blocks' layer scales start at.
    anchored:  joints are known by anchors, too: in the decoder, and in the encoder, which tells a frame's
               joints what they have in common (``FrameMean``). Ours; not in the paper.
    time:      size of the code of time.
    basis:     longest period of the code of time, in frames, over 2 pi; the text does not say.
    """

    width: int = 128
    latent: int = 128
    heads: int = 8
    blocks: tuple[int, int] = (4, 4)
    template: tuple[int, ...] = (16, 32)
    motion: tuple[int, ...] = (3, 16, 32, 64)
    kernel: int = 7
    joined: int = 3
    written: int = 3
    expansion: int = 4
    biased: bool = True
    norm: Norm = "batch"
    affine: bool = True
    scale: float = 1.0
    anchored: bool = False
    time: float = 1.0
    basis: float = 10_000.0


DESIGNS = variants.beside(__file__, Design)


@dataclass(frozen=True)
class HumotConfig:
    """Raises BenchError where a number is out of range."""

    variant: Variant = "small"
    """small, text (the appendix by the letter) or paper_count (2,475,511 parameters)"""
    root_rule: root_rules.ScalingRule = "hip_height"
    """length whose ratio scales the path of the hips"""
    windows: Windows = "overlapping"
    """overlapping windows of 30 frames, or whole clips"""
    weights: str = "puppets"
    """name of shipped weights, or a path to others"""
    subsampling: bool = True
    """false: without stochastic joint subsampling (no SJS)"""
    consistency: float = 0.5
    """weight of the consistency of bone lengths (0: no BLC)"""
    facing: bool = True
    """windows go through the networks turned ahead (false: as the paper)"""
    sized: bool = True
    """bodies go through the networks in one size (false: as the paper)"""
    varied: bool = True
    """training has bodies of other proportions, too, and limbs held otherwise"""
    slanted: bool = False
    """training has bodies whose bones slant otherwise in the reference pose, too"""
    turned: bool = False
    """training windows are turned about the vertical axis at random"""
    mirrored: bool = True
    """every other training window is mirrored"""
    hop: int = 6
    """frames between the starts of training windows"""
    split: Split = "clip"
    """chunk: a tenth of every training clip's windows is kept aside, as in the paper"""

    def __post_init__(self) -> None:
        root_rules.check(self.root_rule, root_rules.SCALING_RULES)
        if not 0.0 <= self.consistency < math.inf:
            raise BenchError("humot: consistency is a weight, zero or more")
        if self.hop < 1:
            raise BenchError("humot: hop is a number of frames, one or more")


PUBLISHED: Mapping[str, str | int | float | bool] = {
    "facing": False,
    "sized": False,
    "varied": False,
    "mirrored": False,
    "root_rule": "leg_length",
}
"""The paper's own way; the variant comes on top."""
DIFFERS = {
    "variant": "small",
    "facing": "facing ahead",
    "sized": "one size",
    "varied": "bodies varied",
    "mirrored": "mirrored",
    "root_rule": "root rule hip_height",
}
"""Parameter -> how its default differs from that."""
