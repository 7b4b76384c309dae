"""Retargeting by NKN and its cross-structural variant: any number of frames, chunk by chunk."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from retarget_bench.errors import NotSupported
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.kinematic import features
from retarget_bench.training.layers.kinematic.pose import MOVES, Scale, quaternions
from retarget_bench.training.layers.kinematic.retargeter import Cases, SightRetargeter

from .network import Decoder, Encoder, Generator
from .network.bodies import Bodies
from .network.rollout import Memory
from .settings import NknConfig
from .training import NknTraining

CHUNK = 256
"""Frames that go through the networks at a time."""


class Stream:
    """A batch of motions while they are retargeted: states, last answers, places and directions.

    encoder, scale: of the sources. decoder, bodies: of the targets.
    """

    def __init__(
        self, encoder: Encoder, scale: Scale, decoder: Decoder, bodies: Bodies, path: features.Path
    ) -> None:
        self._encoder, self._scale, self._decoder, self._bodies = encoder, scale, decoder, bodies
        self._path = path
        self._states: Sequence[Tensor] = ()
        self._memory: Memory | None = None

    def held(self) -> list[Tensor]:
        """All tensors that are carried on to the next frame."""
        if self._memory is None:
            return []
        memory = self._memory
        return [*self._states, memory.lower, memory.upper, memory.pose, memory.rise]

    def advance(
        self, poses: np.ndarray, turn: np.ndarray, hips: np.ndarray, clean: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See ``retargeter.Stream``."""
        with torch.no_grad():
            lower, codes = self._encoder(
                self._scale.poses(torch.from_numpy(poses).to(self._bodies.offsets.device)), self._states
            )
            self._states = (lower[-1].clone(), codes[-1].clone())
            answers, raw, self._memory = self._decoder(codes, self._bodies, self._memory)
            turns = quaternions(raw[..., :-MOVES]).cpu().numpy()
            moves = self._bodies.scale.plain(answers)[..., -MOVES:].cpu().numpy().astype(np.float64)
        if clean:
            moves = features.cleaned(moves, poses[..., -MOVES:])
        return turns, *self._path.follow(moves, turn, hips)


class Retargeter(SightRetargeter):
    """Retargets by an encoder and a decoder of each structure."""

    config: NknConfig

    @property
    def chunk(self) -> int:
        return CHUNK

    def generator(self, joints: int) -> Generator:
        return Generator(joints, self.config.hidden, self.config.cell)

    def stream(self, cases: Cases) -> Stream:
        """Lengths do not matter: nothing real sees what lies behind a row's end."""
        sources, targets, device, heights = cases.sources, cases.targets, cases.device, cases.heights
        source, target = (
            self.networks(device)[self.structure(characters[0])] for characters in (sources, targets)
        )
        unit = np.array([features.unit(each, self.config.lengths) for each in targets])
        path = features.Path(unit, self.config.path, self.config.yaw, self.config.variant)
        offsets = torch.from_numpy(np.stack([self.bones(each) for each in targets])).to(device)
        lacks = torch.from_numpy(np.stack([self.lacks(each) for each in targets]))
        raised = torch.from_numpy(np.asarray(heights) / unit).float().unsqueeze(1) if len(heights) else None
        bodies = Bodies(
            Tree.of(self.body(targets[0]).skeleton).to(device),
            offsets,
            target.scale,
            lacks.to(device) if lacks.any() else None,
            heights=raised.to(device) if raised is not None else None,
        )
        return Stream(source.encoder, source.scale, target.decoder, bodies, path)

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> NknTraining:
        if len(training_data.clips) < 2 and self.config.losses != "autoencoder":
            raise NotSupported(f"{self.card.name} needs two characters to train on, and there is one")
        bodies = self.training_bodies(training_data)
        return NknTraining(bodies, self.config, config, self.using)
