"""Small bodies that dance, as SMRM is trained on them."""

from __future__ import annotations

from typing import Any

import method_bodies
import numpy as np
import torch

from retarget_bench.methods.smrm import SMRM
from retarget_bench.methods.smrm.training import SmrmTraining
from retarget_bench.motion.motion import Motion
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.phases import to_device

BODIES = {
    "one": method_bodies.body("one"),
    "tall": method_bodies.body("tall", scale=1.4),
    "legs": method_bodies.body("legs", thigh=0.6, shin=0.5, arm=0.2),
}


def dances(name: str, lengths: tuple[int, ...] = (40, 50)) -> list[Motion]:
    return [method_bodies.dance(BODIES[name], frames, seed) for seed, frames in enumerate(lengths)]


def training_data(method: SMRM, lengths: tuple[int, ...] = (40, 50)) -> TrainingData:
    clips = {
        name: [
            ClipArrays(
                name, f"dance {k}", {key: a.astype(np.float32) for key, a in method.prepare(motion).items()}
            )
            for k, motion in enumerate(dances(name, lengths))
        ]
        for name in BODIES
    }
    return TrainingData(BODIES, clips)


def training_module(
    lengths: tuple[int, ...] = (40, 50), window: int = 30, **parameters: Any
) -> SmrmTraining:
    method = SMRM(**{"hidden": 16, **parameters})
    torch.manual_seed(0)
    return method.training_module(
        training_data(method, lengths), TrainingConfig(steps=1, batch=4, window=window, rate=1e-3)
    )


def batch(module: SmrmTraining, rows: int = 6, seed: int = 0) -> Any:
    return to_device(module.draw(np.random.default_rng(seed), rows), torch.device("cpu"))
