"""The choices in which the paper and its authors' code differ, for the networks alone.

``PAPER`` is sections 4 and 5 of Hu et al., TVCG 2023, as written; ``RELEASED`` is what their code does for
people, ``RELEASED_THREE`` what it does between two legs and four.
"""

from dataclasses import dataclass, replace
from typing import Literal

DecoderKind = Literal["full", "parts"]
ConvMask = Literal["paper", "released"]


@dataclass(frozen=True)
class Design:
    """Sizes and features of the networks.

    embedding:   hidden widths of the MLP on the four numbers of an edge (eq. 1).
    scaled:      its result is multiplied by the root of ``width`` before the code of the edge's index
                 (eq. 2, 3) is added.
    width:       numbers of an edge, a part's token and a part's code.
    layers:      layers of attention. heads: of each. feedforward: hidden width of the block behind each
                 attention, with residuals and layer norms behind both (0: eq. 4 and 5 and nothing else).
    dropout:     share, of embeddings, attention weights and both blocks.
    mutual:      edges attend to the tokens of their parts too (the symmetric mask of eq. 5); else nobody
                 attends to a token but itself.
    interleaved: the second layer of attention follows the first convolution, which halves the frames; the
                 edges are halved with it, two frames averaged. Else all layers come first.
    leak:        slope of the rectifiers below zero.
    raw:         the first convolution has a second one beside it, from the edges themselves.
    kernel:      taps of all convolutions in time.
    skeleton:    hidden width per part of the MLP on bones (eq. 7). skeleton_bent: its last layer is
                 rectified too. skeleton_share: what its code is multiplied by before it is added.
    decoder:     ``full`` reads all parts for every edge (eq. 8); ``parts``: those that the edge is of.
    conv_mask:   ``released`` shifts the parts of all convolutions by one edge, as the code does by mistake.
    attention:   False: an MLP in its place (Table 5). by_part: False: one token for the whole body, nothing
                 masked, ordinary convolutions (Table 5).
    judging:     width of the discriminator's first layer. squashed: it ends in a sigmoid (eq. 9).
    """

    embedding: tuple[int, ...] = (256, 256)
    scaled: bool = False
    width: int = 32
    layers: int = 2
    heads: int = 1
    feedforward: int = 0
    dropout: float = 0.0
    mutual: bool = True
    interleaved: bool = True
    leak: float = 0.0
    raw: bool = False
    kernel: int = 15
    skeleton: int = 64
    skeleton_bent: bool = False
    skeleton_share: float = 1.0
    decoder: DecoderKind = "full"
    conv_mask: ConvMask = "paper"
    attention: bool = True
    by_part: bool = True
    judging: int = 256
    squashed: bool = True


PAPER = Design()
RELEASED = Design(
    embedding=(512,),
    scaled=True,
    heads=2,
    feedforward=256,
    dropout=0.2,
    mutual=False,
    interleaved=False,
    leak=0.2,
    raw=True,
    skeleton=32,
    skeleton_bent=True,
    skeleton_share=0.01,
    decoder="parts",
)
RELEASED_THREE = replace(RELEASED, layers=1, heads=1, dropout=0.0, squashed=False)
