"""NKN between any structures: an encoder and a decoder for each of them, around codes of one size."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from retarget_bench.api import MethodCard
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.layers.kinematic.many_structures import ManyStructures, StructuresConfig

from ..nkn import DIFFERS, Nkn
from ..nkn.inference import Retargeter
from ..nkn.settings import NknConfig


@dataclass(frozen=True)
class NknCrossConfig(StructuresConfig, NknConfig):
    """Those of ``nkn`` and of structures."""

    hidden: int = 256
    """width of the GRU layers: narrower than NKN's, as there are as many networks as structures"""


class NknCross(ManyStructures, Retargeter):
    """NKN* of the PAN paper (Hu et al., TVCG 2023): NKN made to cross structures.

    Every structure has an encoder, a decoder and a discriminator of its own; codes are of one size, so that
    any encoder goes with any decoder. Half of the training rows stay within a structure, of which some are
    a body's own; the others go to another structure and back. Apart from that it is ``nkn``, whose
    parameters it has. All joints that position errors count are seen, below the hips and in file order, so
    four-legged bodies and those without collar bones can be learned too.

    structures: what is trained on: ``two_legged``, ``all``, or names of structures joined by ``+``. Weights
    know the structures that they were trained on, with any bodies of these.
    ends: weight of a term of our own (PAN's NKN*: 0): on another structure, hands, feet, head, elbows and
    knees are to be where the source's are, in lengths of the chains from the hips to them, and the body is
    to move as far. Without it, going there and back does not tell what lies in between.
    """

    Config = NknCrossConfig
    config: NknCrossConfig
    presets: ClassVar[Mapping[str, TrainingConfig]] = {
        **Nkn.presets,
        "default": TrainingConfig(
            steps=6_000,
            batch=32,
            window=60,
            rate=5e-4,
            schedule="cosine",
            warm_up=200,
            validate=200,
            average=0.999,
        ),
    }

    card = MethodCard(
        name="nkn_cross",
        title="NKN*",
        summary="NKN with an encoder and a decoder for each structure",
        version="1",
        paper="Hu, Zhang, Zhong, Jiang, Wang, Zhang: Pose-Aware Attention Network for Flexible Motion "
        "Retargeting by Body Part, TVCG 2023 (NKN*)",
        published=(
            {"variant": "released", "drift": 0.0, "ends": 0.0, "lengths": "world", "path": "integrated"},
        ),
        differs={**DIFFERS, "ends": "loss on ends of limbs"},
        accepts=("motion", "positions"),
        default=False,
        apart="for the structures in the training data alone",
    )


plugin = NknCross
