"""Network sizes, and the choices that HuMoT's description leaves open.

``PAPER_COUNT`` has as many parameters as Mourot et al., 2023, state: 2,475,511. Many other forms have as
many, so that nothing says that it is theirs. ``TEXT`` is their appendix A.3 as written, around the block of
XCiT (El-Nouby et al., 2021) as published, and has 2,562,629. ``SMALL`` is for processors.
"""

from dataclasses import dataclass, replace
from typing import Literal

Norm = Literal["batch", "layer"]


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
    anchored:  joints are known by anchors, too (``network/anchors.py``): in the decoder, and in the
               encoder, which tells a frame's joints what they have in common (``network/common.py``). Ours;
               not in the paper.
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


TEXT = Design()
PAPER_COUNT = replace(TEXT, kernel=9, joined=2, written=2, expansion=3, biased=False, affine=False)
SMALL = replace(
    PAPER_COUNT,
    blocks=(1, 1),
    norm="layer",
    affine=True,
    scale=0.02,
    anchored=True,
    time=0.25,
)
