"""HuMoT on the small bodies of ``pan_material``, with small networks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import pan_material
import torch
from training_material import training_data

from retarget_bench.methods.humot import DESIGNS, HuMoT
from retarget_bench.methods.humot.training import HumotTraining
from retarget_bench.training.config import TrainingConfig

BODIES, THREE = pan_material.BODIES, pan_material.THREE
WINDOW = 12
THIN: Any = {"width": 32, "latent": 32, "heads": 4, "template": (8, 16), "motion": (3, 8, 16)}
PLAIN = dict.fromkeys(("facing", "sized", "varied", "slanted", "turned", "mirrored"), False)
"""Windows go through training as they are."""


def training_module(
    names: Sequence[str] = THREE, lengths: Sequence[int] = (40, 9), thin: bool = False, **parameters: Any
) -> HumotTraining:
    """The second of every body's clips is shorter than a window.

    thin: networks that are narrower than the variant's; such a learner's method cannot be asked.
    """
    method = HuMoT(**parameters)
    torch.manual_seed(0)
    config = TrainingConfig(steps=1, batch=6, window=WINDOW, rate=1e-3)
    narrow = {name: replace(design, **THIN) for name, design in DESIGNS.items()} if thin else {}
    data = training_data(method, {name: BODIES[name] for name in names}, lengths)
    with patch.dict("retarget_bench.methods.humot.DESIGNS", narrow):
        return method.training_module(data, config)


def trained(names: Sequence[str] = THREE, **parameters: Any) -> Any:
    """A method with weights that are drawn, not learnt."""
    return training_module(names, **parameters).method()
