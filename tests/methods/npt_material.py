"""Small bodies with meshes that all do the same, as NPT is trained on them."""

from __future__ import annotations

from typing import Any

import method_bodies
import numpy as np
import torch
from skinned_toys import skinned_body

from retarget_bench.methods.npt import NPT
from retarget_bench.methods.npt.training import NptTraining
from retarget_bench.motion.motion import Motion
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.phases import to_device

BODIES = {
    "one": skinned_body("one"),
    "tall": skinned_body("tall", scale=1.4),
    "spined": skinned_body("spined", spines=5, arm=0.2),
}


def dances(name: str, frames: int = 12) -> Motion:
    """The same performance by everybody."""
    return method_bodies.dance(BODIES[name], frames, 3)


def training_data(method: NPT) -> TrainingData:
    clips = {name: [ClipArrays(name, "dance", dict(method.prepare(dances(name))))] for name in BODIES}
    return TrainingData(BODIES, clips)


def training_module(**parameters: Any) -> NptTraining:
    method = NPT(**{"width": 24, "points": 60, **parameters})
    torch.manual_seed(0)
    return method.training_module(training_data(method), method.presets["quick"])


def batch(of: NptTraining, rows: int = 6, seed: int = 0) -> Any:
    return to_device(of.draw(np.random.default_rng(seed), rows), torch.device("cpu"))
