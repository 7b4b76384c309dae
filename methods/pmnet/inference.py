"""Retargeting by PMnet and its cross-structural variant, whole clips at a time."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from retarget_bench.api import Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.kinematic import features
from retarget_bench.training.layers.kinematic.pose import MOVES
from retarget_bench.training.layers.kinematic.retargeter import Cases, SightRetargeter
from retarget_bench.training.layers.masks import time_first_mask

from .network import Bodies, Generator, divided
from .settings import PmnetConfig
from .training import PmnetTraining


class Stream:
    """A batch of whole motions; poses go through one by one, movements by convolutions over time.

    sizes: ``(rows, 1)`` of the sources. lengths: frames of each.
    """

    def __init__(
        self,
        source: Generator,
        target: Generator,
        sizes: Tensor,
        bodies: Bodies,
        path: features.Path,
        lengths: Sequence[int],
    ) -> None:
        self._source, self._target, self._sizes, self._bodies = source, target, sizes, bodies
        self._path, self._lengths = path, lengths

    def advance(
        self, poses: np.ndarray, turn: np.ndarray, hips: np.ndarray, clean: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See ``retargeter.Stream``."""
        device = self._sizes.device
        lengths = torch.tensor(self._lengths or [len(poses)] * poses.shape[1], device=device)
        with torch.no_grad():
            normalised = self._source.scale.poses(torch.from_numpy(poses).to(device))
            codes = self._source.encode(normalised[..., :-MOVES])
            turns = self._target.answer(codes, self._bodies).cpu().numpy()
            walked = divided(normalised[..., -MOVES:], self._sizes)
            walks = self._target.moved(walked, time_first_mask(lengths, len(poses)))
            scaled = self._target.scale.restore("moves", divided(walks, 1.0 / self._bodies.sizes))
            moves = scaled.cpu().numpy().astype(np.float64)
        if clean:
            moves = features.cleaned(moves, poses[..., -MOVES:])
        return turns, *self._path.follow(moves, turn, hips)


class Retargeter(SightRetargeter):
    """Retargets by an encoder, two heads of quaternions and a movement network of each structure."""

    config: PmnetConfig

    def generator(self, joints: int) -> Generator:
        return Generator(joints, self.config.hidden)

    def see(self, source: Prediction) -> features.Sight:
        """Ours: relative to the hips, whose row is zero. A pose does not say how far they have risen."""
        sight = super().see(source)
        if self.config.variant == "own":
            sight.poses[:, :3] = 0.0
        return sight

    def size(self, character: Character) -> float:
        """Height along the bones (``Measures.h2``) in hundreds of the unit, as in the authors' code."""
        sizes = character.measures
        return (sizes.h2 or sizes.height) / features.unit(character, self.config.lengths) / 100.0

    def stream(self, cases: Cases) -> Stream:
        sources, targets, device, heights = cases.sources, cases.targets, cases.device, cases.heights
        source, target = (
            self.networks(device)[self.structure(characters[0])] for characters in (sources, targets)
        )
        unit = np.array([features.unit(each, self.config.lengths) for each in targets])
        lacks = torch.from_numpy(np.stack([self.lacks(each) for each in targets]))
        raised = np.asarray(heights) / unit if len(heights) else np.zeros(len(targets))
        bodies = Bodies(
            Tree.of(self.body(targets[0]).skeleton).to(device),
            torch.from_numpy(np.stack([self.bones(each) for each in targets])).to(device),
            _column(raised, device),
            _column([self.size(each) for each in targets], device),
            lacks.to(device) if lacks.any() else None,
        )
        path = features.Path(unit, self.config.path, self.config.yaw, self.config.variant)
        sizes = _column([self.size(each) for each in sources], device)
        return Stream(source, target, sizes, bodies, path, cases.lengths)

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> PmnetTraining:
        if len(training_data.clips) < 2:
            raise NotSupported(f"{self.card.name} needs two characters to train on, and there is one")
        bodies, cast = self.training_bodies(training_data), training_data.characters
        return PmnetTraining(
            bodies,
            {name: self.size(cast[name]) for name in sorted(training_data.clips)},
            {name: self.roles(cast[members[0]]) for name, members in bodies.casts.items()},
            self.config,
            config,
            self.using,
        )


def _column(values: Sequence[float] | np.ndarray, device: str) -> Tensor:
    """``(rows, 1)``"""
    return torch.tensor(np.asarray(values), dtype=torch.float32, device=device).unsqueeze(1)
