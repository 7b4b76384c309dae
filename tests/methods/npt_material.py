"""Small bodies with meshes that all do the same, as NPT is trained on them."""

from __future__ import annotations

from typing import Any

import torch
from skinned_toys import skinned_body
from training_material import training_data

from retarget_bench.methods.npt import NPT
from retarget_bench.methods.npt.training import NptTraining
from retarget_bench.training.config import presets

BODIES = {
    "one": skinned_body("one"),
    "tall": skinned_body("tall", scale=1.4),
    "spined": skinned_body("spined", spines=5, arm=0.2),
}


def training_module(**parameters: Any) -> NptTraining:
    method = NPT(**{"width": 24, "points": 60, **parameters})
    torch.manual_seed(0)
    return method.training_module(training_data(method, BODIES, (12,)), presets(method)["quick"])
