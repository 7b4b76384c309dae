"""How many parameters networks have: counts of record."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import nkn_toys
import pytest
import torch

from retarget_bench.methods.humot import network as humot
from retarget_bench.methods.humot.settings import DESIGNS
from retarget_bench.methods.nkn.network import Generator as KinematicGenerator
from retarget_bench.methods.nkn_cross import plugin as NknCross
from retarget_bench.methods.paired.network import Corrector
from retarget_bench.methods.pmnet import plugin as Pmnet
from retarget_bench.methods.pmnet_cross import plugin as PmnetCross
from retarget_bench.methods.r2et.discriminator import TrajectoryDiscriminator
from retarget_bench.methods.r2et.network import SkeletonAwareNetwork
from retarget_bench.methods.same import network as same
from retarget_bench.methods.skin.network import SkinningPredictor
from retarget_bench.methods.skr.network import SkeletonRegressor
from retarget_bench.training.layers.temporal_discriminator import TemporalDiscriminator

ONE_STRUCTURE = {name: nkn_toys.STRUCTURES[name] for name in ("one", "long")}
COUNTS: dict[str, tuple[Callable[[], Any], int]] = {
    "nkn": (lambda: KinematicGenerator(22, 512, "tf"), 5_870_172),
    "nkn, torch's cell": (lambda: KinematicGenerator(22, 512, "torch"), 5_876_316),
    "nkn's discriminator": (TemporalDiscriminator, 280_413),
    "nkn_cross, one structure": (
        lambda: nkn_toys.training_module(NknCross(hidden=512), cast=ONE_STRUCTURE).modules["generator"],
        5_870_172,
    ),
    "pmnet": (lambda: nkn_toys.training_module(Pmnet()).modules["generator"], 918_244),
    "pmnet's discriminator": (
        lambda: nkn_toys.training_module(Pmnet()).modules["discriminator"],
        27_569,
    ),
    "pmnet_cross, one structure": (
        lambda: nkn_toys.training_module(PmnetCross(), cast=ONE_STRUCTURE).modules["generator"],
        918_244,
    ),
    "r2et": (SkeletonAwareNetwork, 446_276),
    "r2et's discriminator": (TrajectoryDiscriminator, 27_505),
    "humot, as many as the paper": (lambda: humot_networks(DESIGNS["paper_count"]), 2_475_511),
    "humot, as the text": (lambda: humot_networks(DESIGNS["text"]), 2_562_629),
    "humot": (lambda: humot_networks(DESIGNS["small"]), 1_385_799),
    "same": (same.Autoencoder, 298_947),
    "skr": (lambda: SkeletonRegressor(False), 1_612_875),
    "skr, table 5": (lambda: SkeletonRegressor(True), 3_466_251),
    "skin, distances": (lambda: SkinningPredictor("distances"), 77_334),
    "skin, vectors": (lambda: SkinningPredictor("vectors"), 88_598),
    "paired": (Corrector, 2_480_660),
}
"""Parameters of record."""


def humot_networks(design: Any) -> torch.nn.Module:
    return torch.nn.ModuleList([humot.Encoder(design), humot.Decoder(design)])


@pytest.mark.parametrize("name", COUNTS)
def test_networks_have_the_parameters_of_record(name: str) -> None:
    build, count = COUNTS[name]
    assert sum(each.numel() for each in build().parameters()) == count
