"""Small bodies that dance, as R2ET is trained on them."""

from __future__ import annotations

from typing import Any

import numpy as np
import smrm_material
import torch
from method_bodies import body, dance, without

from retarget_bench.methods.r2et import R2ET
from retarget_bench.methods.r2et.training import R2ETTraining
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.phases import to_device

SHORT = without(
    body("short"), "LeftToeBase", "RightToeBase", "LeftShoulder", "RightShoulder", "Spine2", "Neck"
)
BODIES = {**smrm_material.BODIES, "short": SHORT}


def training_data(lengths: tuple[int, ...] = (32, 20)) -> TrainingData:
    clips = {
        name: [
            ClipArrays(name, f"dance {seed}", R2ET().prepare(dance(character, frames, seed)))
            for seed, frames in enumerate(lengths)
        ]
        for name, character in BODIES.items()
    }
    return TrainingData(BODIES, clips)


def training_module(window: int = 30) -> R2ETTraining:
    torch.manual_seed(0)
    return R2ET().training_module(
        training_data(), TrainingConfig(steps=1, batch=4, window=window, rate=1e-3)
    )


def batch(module: R2ETTraining, rows: int = 6, seed: int = 0) -> Any:
    return to_device(module.draw(np.random.default_rng(seed), rows), torch.device("cpu"))
