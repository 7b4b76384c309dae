"""Small bodies that dance, as SMRM is trained on them."""

from __future__ import annotations

from typing import Any

import method_bodies
import numpy as np
import torch

from retarget_bench.methods.smrm import SMRM
from retarget_bench.methods.smrm.learner import SMRMLearner
from retarget_bench.motion.motion import Motion
from retarget_bench.training.config import Recipe
from retarget_bench.training.data import Clip, Material
from retarget_bench.training.phases import moved

BODIES = {
    "one": method_bodies.body("one"),
    "tall": method_bodies.body("tall", scale=1.4),
    "legs": method_bodies.body("legs", thigh=0.6, shin=0.5, arm=0.2),
}


def dances(name: str, lengths: tuple[int, ...] = (40, 50)) -> list[Motion]:
    return [method_bodies.dance(BODIES[name], frames, seed) for seed, frames in enumerate(lengths)]


def material(method: SMRM, lengths: tuple[int, ...] = (40, 50)) -> Material:
    clips = {
        name: [
            Clip(
                name, f"dance {k}", {key: a.astype(np.float32) for key, a in method.prepare(motion).items()}
            )
            for k, motion in enumerate(dances(name, lengths))
        ]
        for name in BODIES
    }
    return Material(BODIES, clips)


def learner(lengths: tuple[int, ...] = (40, 50), window: int = 30, **parameters: Any) -> SMRMLearner:
    method = SMRM(**{"hidden": 16, **parameters})
    torch.manual_seed(0)
    return method.learner(material(method, lengths), Recipe(steps=1, batch=4, window=window, rate=1e-3))


def batch(learner: SMRMLearner, rows: int = 6, seed: int = 0) -> Any:
    return moved(learner.draw(np.random.default_rng(seed), rows), torch.device("cpu"))
