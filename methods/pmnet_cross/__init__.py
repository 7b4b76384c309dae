"""PMnet between any structures: networks of their own for each of them, around features of one size."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from retarget_bench.api import MethodCard
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.layers.kinematic.many_structures import ManyStructures, StructuresConfig

from ..pmnet import DIFFERS, Pmnet
from ..pmnet.inference import Retargeter
from ..pmnet.settings import PmnetConfig


@dataclass(frozen=True)
class PmnetCrossConfig(StructuresConfig, PmnetConfig):
    """Those of ``pmnet`` and of structures."""


class PmnetCross(ManyStructures, Retargeter):
    """PMnet* of the PAN paper (Hu et al., TVCG 2023): PMnet made to cross structures.

    Every structure has an encoder, two heads, a network of movements and a discriminator of its own;
    features are of one size, so that the heads of any structure can answer for any encoder. Half of the
    training rows stay within a structure; the others go to another one, where an answer has to have the
    source's features. Apart from that it is ``pmnet``, whose parameters it has; structures and ``ends`` are
    those of ``nkn_cross``.
    """

    Config = PmnetCrossConfig
    config: PmnetCrossConfig
    presets: ClassVar[Mapping[str, TrainingConfig]] = Pmnet.presets

    card = MethodCard(
        name="pmnet_cross",
        title="PMnet*",
        summary="PMnet with networks for each structure",
        version="1",
        paper="Hu, Zhang, Zhong, Jiang, Xia: Pose-aware Attention Network for Flexible Motion "
        "Retargeting by Body Part, TVCG 2023 (PMnet*)",
        published=({**Pmnet.card.published[0], "ends": 0.0},),
        differs={**DIFFERS, "ends": "loss on ends of limbs"},
        accepts=("motion", "positions"),
        default=False,
        apart="for the structures in the training data alone",
    )


plugin = PmnetCross
