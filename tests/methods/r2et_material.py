"""Small bodies that dance, as R2ET is trained on them."""

from __future__ import annotations

import smrm_material
import torch
from method_bodies import body, without
from training_material import training_data

from retarget_bench.methods.r2et import R2ET
from retarget_bench.methods.r2et.training import R2ETTraining
from retarget_bench.training.config import TrainingConfig

SHORT = without(
    body("short"), "LeftToeBase", "RightToeBase", "LeftShoulder", "RightShoulder", "Spine2", "Neck"
)
BODIES = {**smrm_material.BODIES, "short": SHORT}


def training_module(window: int = 30) -> R2ETTraining:
    method = R2ET()
    torch.manual_seed(0)
    return method.training_module(
        training_data(method, BODIES, (32, 20)), TrainingConfig(steps=1, batch=4, window=window, rate=1e-3)
    )
