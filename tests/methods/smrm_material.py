"""Small bodies that dance, as SMRM is trained on them."""

from __future__ import annotations

from typing import Any

import method_bodies
import torch
from training_material import training_data

from retarget_bench.methods.smrm import SMRM
from retarget_bench.methods.smrm.training import SmrmTraining
from retarget_bench.training.config import TrainingConfig

BODIES = {
    "one": method_bodies.body("one"),
    "tall": method_bodies.body("tall", scale=1.4),
    "legs": method_bodies.body("legs", thigh=0.6, shin=0.5, arm=0.2),
}


def training_module(
    lengths: tuple[int, ...] = (40, 50), window: int = 30, **parameters: Any
) -> SmrmTraining:
    method = SMRM(**{"hidden": 16, **parameters})
    torch.manual_seed(0)
    return method.training_module(
        training_data(method, BODIES, lengths), TrainingConfig(steps=1, batch=4, window=window, rate=1e-3)
    )
