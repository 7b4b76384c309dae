"""SAN on PAN's small dancing bodies."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import pan_material
import torch
from pan_material import BODIES, TWO
from training_material import training_data

from retarget_bench.methods.san import San
from retarget_bench.methods.san.training import SanTraining
from retarget_bench.training.config import TrainingConfig

WINDOW = 32
THREE, LEGS = pan_material.THREE, pan_material.LEGS
__all__ = ["BODIES", "LEGS", "THREE", "TWO", "WINDOW", "trained", "training_module"]


def training_module(names: Sequence[str] = TWO, seed: int = 0, **parameters: Any) -> SanTraining:
    method: Any = San(**parameters)
    torch.manual_seed(seed)
    cast = {name: BODIES[name] for name in names}
    return method.training_module(
        training_data(method, cast, (30, 40)),
        TrainingConfig(steps=1, batch=4, window=WINDOW, rate=1e-3),
    )


@cache
def trained(names: Sequence[str] = TWO, **parameters: Any) -> San:
    """A method with weights that are drawn, not learnt: answers that differ from frame to frame."""
    method: Any = training_module(names, **parameters).method()
    return method  # type: ignore[no-any-return]
