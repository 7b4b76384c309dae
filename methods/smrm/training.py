"""SMRM while it is trained: batches of characters and motions, and the losses of eq. 2."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.errors import NotSupported
from retarget_bench.motion import facing, rotation
from retarget_bench.motion.body22 import JOINTS
from retarget_bench.training import weights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import TrainingData, WindowBatch
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.adversarial import NknUpdateRule, cross_entropy
from retarget_bench.training.layers.masks import frame_mask
from retarget_bench.training.layers.temporal_discriminator import TemporalDiscriminator

from . import losses
from .features import FPS, Features
from .network import MOVES, Answer, Generator
from .settings import SmrmConfig

LEAST = 1e-2
"""Units: what varies less between frames or bodies is not blown up; of the hips a tenth."""


class SmrmTraining:
    """A ``TrainingModule`` (see ``training/contract.py``)."""

    def __init__(
        self,
        training_data: TrainingData,
        config: TrainingConfig,
        features: Features,
        weighting: SmrmConfig,
        generator: Generator,
        trained: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        """weighting: the method's parameters. trained: makes the method from exported tensors.
        Raises NotSupported with one character only."""
        if len(training_data.clips) < 2:
            raise NotSupported("smrm learns from at least two characters, and there is one")
        self.training_data, self.features = training_data, features
        self.weighting, self._trained = weighting, trained
        self._window, self._noise = config.window, weighting.noise
        self._names = sorted(training_data.clips)
        bodies = [features.body(training_data.characters[name]) for name in self._names]
        self._number = {name: number for number, name in enumerate(self._names)}
        self._offsets = np.stack([body.offsets for body in bodies])
        self._resting = np.stack([body.resting for body in bodies])
        self._lacks = np.stack([body.aligned.lacks for body in bodies])
        if features.normalisation != "none":
            self._fit(generator)
        self.generator, self.rule = generator, NknUpdateRule()
        self.discriminator = TemporalDiscriminator(3 * JOINTS + MOVES, 3 * (JOINTS - 1))
        self.modules = nn.ModuleDict({"generator": generator})
        self.phases: Sequence[Phase] = (Phase("generator", ("generator",), clip=1.0),)
        self._adversarial = weighting.adversarial_weight > 0 and weighting.same_share < 1
        if self._adversarial:
            self.modules["discriminator"], self.modules["rule"] = self.discriminator, self.rule
            self.phases = (*self.phases, Phase("discriminator", ("discriminator",)))

    def _fit(self, generator: Generator) -> None:
        """Means and deviations, of all clips and bodies."""
        moves = [
            self.features.moves(clip.arrays["hips"], clip.arrays["before"], clip.arrays["turn"])
            for name in self._names
            for clip in self.training_data.clips[name]
        ]
        for kind, values, least in (
            ("positions", self.training_data.stacked("positions"), LEAST),
            ("moves", np.concatenate(moves), 0.1 * LEAST),
            ("resting", self._resting, LEAST),
        ):
            generator.scale.fit(kind, values, least=least)

    # ---------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        """A window of a character per row, a body to carry it to, and a window of that body's own."""
        own = self.training_data.cast(numbers, rows)
        others = [self.training_data.another(numbers, name) for name in own]
        same = numbers.random(rows) < self.weighting.same_share
        if self._adversarial:
            same[0] &= not same.all()  # there is always a row for the discriminator
        target = [a if keep else b for a, b, keep in zip(own, others, same, strict=True)]
        batch: dict[str, Any] = {
            "source": self._inputs(numbers, self.training_data.draw(numbers, own, self._window)),
            "body": self._bodies(own),
            "target": self._bodies(target),
            "same": same,
            "other": np.flatnonzero(~same),
        }
        batch["shown"] = self._noisy(numbers, batch["source"])
        if self._adversarial:
            batch["real"] = self._inputs(numbers, self.training_data.draw(numbers, target, self._window))
        return batch

    def _bodies(self, names: Sequence[str]) -> dict[str, Any]:
        rows = [self._number[name] for name in names]
        return {
            "offsets": self._offsets[rows],
            "resting": self._resting[rows],
            "lacks": self._lacks[rows],
            "lacking": np.flatnonzero(self._lacks[rows].any(0)).tolist(),
        }

    def _inputs(self, numbers: np.random.Generator, windows: WindowBatch) -> dict[str, np.ndarray]:
        """Windows as the networks see them; where the direction is kept, turned at random."""
        arrays = dict(windows.arrays)
        if self.features.yaw == "kept":
            arrays = _turned(arrays, np.exp(2j * np.pi * numbers.random((len(windows.lengths), 1))))
        moves = self.features.moves(arrays["hips"], arrays["before"], arrays["turn"])
        inputs = {key: arrays[key] for key in ("positions", "rotations", "turn")}
        inputs["moves"] = moves * windows.mask[..., None]
        inputs = {key: array.astype(np.float32, copy=False) for key, array in inputs.items()}
        return inputs | {"lengths": windows.lengths}

    def _noisy(
        self, numbers: np.random.Generator, inputs: Mapping[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        """Inputs of the encoder with noise on positions and moves of joints."""
        positions, moves = inputs["positions"], inputs["moves"]
        if self._noise:
            off = numbers.normal(0.0, self._noise, positions.shape).astype(np.float32)
            hips = off[:, :, :1]
            positions = positions + off - hips
            moves = moves + self.features.moved_by(hips[:, :, 0])
        return {"positions": positions, "moves": moves}

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        if phase == "discriminator":
            return self._discriminate(batch, memory)
        source, weighting = batch["source"], self.weighting
        codes, _ = self.generator.encode(batch["shown"]["positions"], batch["shown"]["moves"])
        there = self._decoded(codes, batch["target"])
        again, _ = self.generator.encode(there.positions, there.moves)
        back = self._decoded(again, batch["body"])
        real = frame_mask(source["lengths"], codes.shape[1])
        reference = source["rotations"]
        if weighting.reference_rotation == "self":
            reference = self._decoded(codes, batch["body"]).rotations.detach()
        same = real & batch["same"].unsqueeze(1)
        turning = losses.rotations(back.rotations, reference, real)
        path = self.features.path(there.moves, source["turn"])
        terms = {
            "joints": losses.squares(back.positions, source["positions"], real),
            "hips": self._astray(back, source, real),
            "self_joints": losses.squares(there.positions, source["positions"], same),
            "self_hips": self._astray(there, source, same),
            "rotations": weighting.rotation_cycle * turning,
            "smooth": weighting.smooth * losses.acceleration(path, real),
        }
        if self._adversarial:
            terms["adversarial"] = weighting.adversarial_weight * self._fooling(there, batch, memory)
        return terms

    def _decoded(self, codes: Tensor, body: Mapping[str, Any]) -> Answer:
        offsets, resting = body["offsets"], body["resting"]
        return self.generator.decode(codes, offsets, resting, None, body["lacks"], body["lacking"])[0]

    def _astray(self, answer: Answer, source: Mapping[str, Tensor], real: Tensor) -> Tensor:
        """Squared distance of the hips' path from the source's, over the window."""
        path = self.features.path(answer.moves, source["turn"])
        return losses.squares(path, self.features.path(source["moves"], source["turn"]), real)

    def _fooling(self, answer: Answer, batch: Batch, memory: dict[str, Any]) -> Tensor:
        """The adversarial term, of the rows that went to another body; what the discriminator's phase needs
        is left in ``memory``."""
        other = batch["other"]
        shown = self._shown(answer.positions, answer.moves)[other]
        bones = batch["target"]["offsets"][:, 1:].flatten(1)[other]
        lengths = (batch["source"]["lengths"] - 1)[other]
        logits = self.discriminator(shown, bones, lengths)
        memory["shown"] = (shown.detach(), bones, lengths, logits)
        return cross_entropy(logits, True).mean()

    def _discriminate(self, batch: Batch, memory: dict[str, Any]) -> Terms:
        shown, bones, lengths, logits = memory["shown"]
        if not any(self.rule.update([(0, logits)])):
            return {}
        other, real = batch["other"], batch["real"]
        truth = self._shown(real["positions"], real["moves"])[other]
        true = self.discriminator(truth, bones, (real["lengths"] - 1)[other], learns=True)
        fake = self.discriminator(shown, bones, lengths, learns=True)
        return {"real": cross_entropy(true, True).mean(), "shown": cross_entropy(fake, False).mean()}

    def _shown(self, positions: Tensor, moves: Tensor) -> Tensor:
        """``(rows, frames - 1, 69)`` what the discriminator sees: units per second of joints and hips."""
        return FPS * torch.cat([positions.flatten(-2).diff(dim=1), self.features.velocity(moves)], -1)

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._trained(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return exported(self.generator)

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        weights.fill(self.generator, tensors)


def _turned(arrays: Mapping[str, np.ndarray], about: np.ndarray) -> dict[str, np.ndarray]:
    """Windows turned about the vertical axis by unit complex numbers ``(rows, 1)``."""
    turned = {key: facing.placed(arrays[key], about) for key in ("hips", "before")}
    turned["positions"] = facing.placed(arrays["positions"], about[..., None])
    rotations = arrays["rotations"].copy()
    rotations[:, :, 0] = rotation.multiply(facing.rotation(about), rotations[:, :, 0])
    return {**arrays, **turned, "rotations": rotations}
