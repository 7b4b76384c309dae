"""HuMoT on the small bodies of ``pan_material``, with small networks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pan_material
import torch

from retarget_bench.methods.humot import DESIGNS, HuMoT
from retarget_bench.methods.humot.training import Learner
from retarget_bench.training.config import Recipe
from retarget_bench.training.data import Material
from retarget_bench.training.phases import moved

BODIES, THREE = pan_material.BODIES, pan_material.THREE
WINDOW = 12
THIN: Any = {"width": 32, "latent": 32, "heads": 4, "template": (8, 16), "motion": (3, 8, 16)}
PLAIN = {"facing": False, "sized": False, "varied": False, "turned": False, "mirrored": False}
"""Windows go through training as they are."""


def material(method: HuMoT, names: Sequence[str] = THREE, lengths: Sequence[int] = (40, 9)) -> Material:
    """The second of every body's clips is shorter than a window."""
    return pan_material.material(method, names, lengths)  # type: ignore[arg-type]


def learner(
    names: Sequence[str] = THREE, lengths: Sequence[int] = (40, 9), thin: bool = False, **parameters: Any
) -> Learner:
    """thin: networks that are narrower than the variant's; such a learner's method cannot be asked."""
    method = HuMoT(**parameters)
    torch.manual_seed(0)
    recipe = Recipe(steps=1, batch=6, window=WINDOW, rate=1e-3)
    narrow = {name: replace(design, **THIN) for name, design in DESIGNS.items()} if thin else {}
    with patch.dict("retarget_bench.methods.humot.DESIGNS", narrow):
        return method.learner(material(method, names, lengths), recipe)


def batch(mine: Learner, rows: int = 6, seed: int = 0) -> Any:
    return moved(mine.draw(np.random.default_rng(seed), rows), torch.device("cpu"))


def trained(names: Sequence[str] = THREE, **parameters: Any) -> Any:
    """A method with weights that are drawn, not learnt."""
    return learner(names, **parameters).method()
