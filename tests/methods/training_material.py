"""What learned methods are trained on in tests: dances of small bodies, and batches of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from method_bodies import dance

from retarget_bench.motion.character import Character
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.phases import to_device


def training_data(method: Any, cast: Mapping[str, Character], lengths: Sequence[int]) -> TrainingData:
    """A dance of each of these numbers of frames by every body, as a method sees them."""
    clips = {}
    for name, character in cast.items():
        dances = [dance(character, frames, seed) for seed, frames in enumerate(lengths)]
        clips[name] = [
            ClipArrays(name, f"dance {number}", single_precision(method.prepare(motion)))
            for number, motion in enumerate(dances)
        ]
    return TrainingData(dict(cast), clips)


def single_precision(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What training keeps of what a method makes of a motion."""
    return {key: array.astype(np.float32) for key, array in arrays.items()}


def batch(module: Any, rows: int = 6, seed: int = 0) -> Any:
    """A batch that a learner draws, as tensors."""
    return to_device(module.draw(np.random.default_rng(seed), rows), torch.device("cpu"))
