"""Paired while it is trained: windows of one performance by two bodies."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.errors import NotSupported
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.layers import exported

from . import losses
from .augmentation import mirrored, mirrored_bones, reposed, spare, turns, without
from .features import RoleBody
from .network import Corrector, applied, inputs_of

WEIGHTS = {
    "world": 1.0,
    "relative": 1.0,
    "speed": 6.0,
    "acceleration": 12.0,
    "rests": 3.0,
    "floor": 1.0,
    "turns": 0.02,
    "touch": 0.5,
}
SAME = 0.1
"""Share of rows whose target is the source itself."""
LIFTED, LIFT = 0.5, 0.04
"""Share of rows whose floor is not at zero, and its standard deviation in heights of the hips."""


class PairedTraining:
    """A ``TrainingModule`` (see ``training/contract.py``)."""

    def __init__(
        self,
        training_data: TrainingData,
        config: TrainingConfig,
        network: Corrector,
        trained: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        """trained: makes the method from exported tensors. Raises NotSupported where no clip is performed
        by two bodies."""
        by_clip: dict[str, list[ClipArrays]] = {}
        for clips in training_data.clips.values():
            for clip in clips:
                by_clip.setdefault(clip.name, []).append(clip)
        self._performances = [clips for clips in by_clip.values() if len(clips) > 1]
        if not self._performances:
            raise NotSupported("paired learns from the same performance by two bodies, and there is none")
        self._ends = np.cumsum([clips[0].frames for clips in self._performances])
        bodies = {name: RoleBody(training_data.characters[name]) for name in training_data.clips}
        self._bodies = {name: (body.offsets, body.lengths) for name, body in bodies.items()}
        self._window, self._trained = config.window, trained
        network.figures.learn(self._bodies.values())
        self.network = network
        self.modules = nn.ModuleDict({"network": network})
        self.phases: Sequence[Phase] = (Phase("network", ("network",), clip=20.0),)

    # ---------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        drawn = [self._row(numbers) for _ in range(rows)]
        return {
            key: {name: np.stack([row[key][name] for row in drawn]) for name in drawn[0][key]}
            for key in drawn[0]
        }

    def _row(self, numbers: np.random.Generator) -> dict[str, dict[str, np.ndarray]]:
        """A window of one performance: ``motion`` of the ``source``, ``truth`` of the ``target``."""
        clips = self._performances[
            int(np.searchsorted(self._ends, numbers.integers(self._ends[-1]), "right"))
        ]
        first, second = numbers.choice(len(clips), 2, replace=False)
        pair = clips[first], clips[first if numbers.random() < SAME else second]
        start = int(numbers.integers(max(pair[0].frames - self._window, 0) + 1))
        flip = numbers.random() < 0.5
        lacking = [spare(numbers), spare(numbers)]
        poses = [turns(numbers), turns(numbers)]
        if pair[0] is pair[1]:
            lacking[1], poses[1] = lacking[0], poses[0]
        row: dict[str, dict[str, np.ndarray]] = {}
        names = (("motion", "source"), ("truth", "target"))
        for clip, lacks, pose, (motion, body) in zip(pair, lacking, poses, names, strict=True):
            arrays = {key: each[start : start + self._window] for key, each in clip.arrays.items()}
            offsets, lengths = self._bodies[clip.character]
            if flip:
                arrays, offsets = mirrored(arrays), mirrored_bones(offsets)
            arrays, offsets = without(*reposed(arrays, offsets, pose), lacks)
            row[motion] = {key: self._padded(each) for key, each in arrays.items()}
            row[body] = {"offsets": offsets, "lengths": lengths}
        self._lift(numbers, row)
        real = np.arange(self._window) < pair[0].frames - start
        return {**row, "real": {"frames": real}}

    @staticmethod
    def _lift(numbers: np.random.Generator, row: dict[str, dict[str, np.ndarray]]) -> None:
        """Move both bodies up or down, in place: many files have the floor elsewhere than at zero."""
        if numbers.random() < LIFTED:
            height = LIFT * numbers.standard_normal()
            for motion, body in (("motion", "source"), ("truth", "target")):
                moved = row[motion]["hips"].copy()
                moved[:, 1] += np.float32(height * row[body]["lengths"][1])
                row[motion]["hips"] = moved

    def _padded(self, array: np.ndarray) -> np.ndarray:
        """The last frame again up to the window's length."""
        missing = self._window - len(array)
        return np.concatenate([array, np.repeat(array[-1:], missing, axis=0)]) if missing else array

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        del phase, memory
        network, real = self.network, batch["real"]["frames"]
        bodies = batch["source"], batch["target"]
        correction = network(*inputs_of(network, batch["motion"], *bodies), real)
        with torch.autocast(real.device.type, enabled=False):
            answer = applied(network, correction, batch["motion"], *bodies)
            terms = losses.terms(network.tree, answer, batch["truth"], batch["target"], real)
        return {name: WEIGHTS[name] * term for name, term in terms.items()}

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._trained(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return exported(self.network)

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        self.network.take(tensors)
        self.network.figures.learn(self._bodies.values())
