"""SAN on PAN's small dancing bodies."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import pan_material
import torch
from pan_material import BODIES, TWO, dances

from retarget_bench.methods.san import San
from retarget_bench.methods.san.training import SanTraining
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.phases import to_device

WINDOW = 32
THREE, LEGS = pan_material.THREE, pan_material.LEGS
__all__ = ["BODIES", "LEGS", "THREE", "TWO", "WINDOW", "batch", "dances", "trained", "training_module"]


def training_module(names: Sequence[str] = TWO, seed: int = 0, **parameters: Any) -> SanTraining:
    method: Any = San(**parameters)
    torch.manual_seed(seed)
    return method.training_module(
        pan_material.training_data(method, names),
        TrainingConfig(steps=1, batch=4, window=WINDOW, rate=1e-3),
    )


def batch(module: SanTraining, rows: int = 4, seed: int = 0) -> Any:
    return to_device(module.draw(np.random.default_rng(seed), rows), torch.device("cpu"))


@cache
def trained(names: Sequence[str] = TWO, **parameters: Any) -> San:
    """A method with weights that are drawn, not learnt: answers that differ from frame to frame."""
    made: Any = training_module(names, **parameters).method()
    return made  # type: ignore[no-any-return]
