"""R2ET's skeleton-aware network while it is trained: windows of characters, and bodies to carry them to."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.errors import NotSupported
from retarget_bench.motion import facing, rotation
from retarget_bench.motion.body22 import SKELETON, Body22, folded
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.kinematics_torch import forward as kinematics
from retarget_bench.training import weights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.adversarial import NknUpdateRule, cross_entropy
from retarget_bench.training.layers.masks import frame_mask
from retarget_bench.training.layers.twist import twist

from . import features, losses
from .discriminator import TrajectoryDiscriminator
from .network import SkeletonAwareNetwork

SAME = 0.5
"""Share of rows whose target is their own character."""
STILL, LEAST = 1e-3, 0.02
"""Centimetres: what deviates less is a constant. Least deviation of a number of a quaternion: what hardly
turns in training is not blown up."""


class R2ETTraining:
    """A ``TrainingModule`` (see ``training/contract.py``).

    The discriminator learns by NKN's and PMnet's rule, while it takes more than three answers in ten for
    real; the published code lets it learn where any answer of the batch is above that.
    """

    def __init__(
        self,
        training_data: TrainingData,
        config: TrainingConfig,
        network: SkeletonAwareNetwork,
        trained: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        """trained: makes the method from exported tensors. Raises NotSupported with one character only."""
        if len(training_data.clips) < 2:
            raise NotSupported("r2et learns from at least two characters, and there is one")
        self.training_data, self._window, self._trained = training_data, config.window, trained
        self._names = sorted(training_data.clips)
        self._number = {name: number for number, name in enumerate(self._names)}
        bodies = [training_data.characters[name] for name in self._names]
        self._offsets = np.stack([features.offsets(each) for each in bodies])
        self._lacks = np.stack([Body22.of(each).lacks for each in bodies])
        self._heights = np.array([features.size(each, "chain") for each in bodies], np.float32)
        positions = np.concatenate([training_data.stacked("positions"), self._offsets])
        network.scale.fit("positions", positions, constant=STILL)
        network.scale.fit("rotations", training_data.stacked("rotations"), least=LEAST)
        self.network, self.discriminator = network, TrajectoryDiscriminator()
        self.rule = NknUpdateRule()
        self.modules = nn.ModuleDict(
            {"network": network, "discriminator": self.discriminator, "rule": self.rule}
        )
        self.phases: Sequence[Phase] = [
            Phase(name, (name,), betas=(0.5, 0.999), clip=25.0) for name in ("network", "discriminator")
        ]
        self._tree = Tree.of(SKELETON)
        self._weights = losses.joint_weights()

    # ---------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        """A window of a character per row, and a body to carry it to.

        path: ``(rows, frames, 3)`` centimetres of the hips, and turn: ``(rows, frames, 2)`` where the body
        faces, both since the window's first frame.
        """
        own = self.training_data.cast(numbers, rows)
        same = numbers.random(rows) < SAME
        same[0] &= not same.all()  # there is always a row for the discriminator
        target = [
            name if keep else self.training_data.another(numbers, name)
            for name, keep in zip(own, same, strict=True)
        ]
        windows = self.training_data.draw(numbers, own, self._window)
        arrays, mask = windows.arrays, windows.mask[..., None]
        turn = arrays["turn"][..., 0] + 1j * arrays["turn"][..., 1]
        since = turn * turn[:, :1].conj()
        path = facing.seen(arrays["hips"] - arrays["hips"][:, :1], turn[:, :1])
        return {
            "rotations": np.where(mask[..., None], arrays["rotations"], rotation.identity(1)).astype("f4"),
            "positions": arrays["positions"].astype("f4"),
            "path": (path * mask).astype("f4"),
            "turn": np.stack([since.real, since.imag], -1).astype("f4"),
            "lengths": windows.lengths,
            "source": self._bodies(own),
            "target": self._bodies(target),
            "same": same,
            "other": np.flatnonzero(~same),
        }

    def _bodies(self, names: Sequence[str]) -> dict[str, Any]:
        rows = [self._number[name] for name in names]
        return {
            "offsets": self._offsets[rows],
            "heights": self._heights[rows],
            "lacks": self._lacks[rows],
            "lacking": np.flatnonzero(self._lacks[rows].any(0)).tolist(),
        }

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        if phase == "discriminator":
            return self._discriminate(memory)
        turned, places = self._answered(batch)
        source, real = batch["rotations"], frame_mask(batch["lengths"], self._window)
        own = real & batch["same"].unsqueeze(1)
        normalised, answered = (
            self.network.normal("positions", each) for each in (batch["positions"], places)
        )
        joint_weights = self._weights.to(normalised.device, non_blocking=True)
        return {
            "positions": losses.positions(answered, normalised, joint_weights, own),
            "rotations": losses.rotations(turned, source, own),
            "twist": losses.TWIST * twist(turned[..., 1:, :], real) / real.sum(),
            "semantics": losses.SEMANTICS * losses.semantics(places, batch["positions"], real),
            "adversarial": losses.ADVERSARIAL * self._fooling(normalised, answered, batch, memory),
        }

    def _answered(self, batch: Batch) -> tuple[Tensor, Tensor]:
        """Rotations ``(rows, frames, 22, 4)`` of the targets, and positions ``(rows, frames, 22, 3)``."""
        target = batch["target"]
        codes = (self.network.bones(batch[body]["offsets"]).unsqueeze(1) for body in ("source", "target"))
        turned = rotation.multiply(batch["rotations"], self.network(batch["rotations"], *codes))
        turned = folded(turned, target["lacks"].unsqueeze(1), target["lacking"])
        offsets = target["offsets"]
        if self._tree.mask.device != offsets.device:
            self._tree = self._tree.to(offsets.device)
        hips = offsets[:, :1].expand(-1, turned.shape[1], -1)
        return turned, kinematics(self._tree, offsets, turned, hips)[0]

    # --------------------------------------------------------------------------------- discriminator
    def _fooling(
        self, normalised: Tensor, answered: Tensor, batch: Batch, memory: dict[str, Any]
    ) -> Tensor:
        """The adversarial term, of the rows that went to another body; what the discriminator's phase needs
        is left in ``memory``."""
        rows = batch["other"]
        real = _trajectory(normalised, batch, batch["source"]["heights"])[rows]
        shown, lengths = (
            _trajectory(answered, batch, batch["target"]["heights"])[rows],
            batch["lengths"][rows],
        )
        logits = self.discriminator(shown, lengths)
        memory["shown"] = (real, shown.detach(), lengths, logits)
        return cross_entropy(logits, True).mean()

    def _discriminate(self, memory: dict[str, Any]) -> Terms:
        real, shown, lengths, logits = memory["shown"]
        if not any(self.rule.update([(0, logits)])):
            return {}
        true, fake = (self.discriminator(each, lengths, learns=True) for each in (real, shown))
        return {"real": cross_entropy(true, True).mean(), "shown": cross_entropy(fake, False).mean()}

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._trained(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return exported(self.network)

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        weights.fill(self.network, tensors)


def _trajectory(places: Tensor, batch: Batch, heights: Tensor) -> Tensor:
    """``(rows, frames, 3)`` what the discriminator sees: the mean of the joints along the path, over the
    height in metres.

    As in the published code, joints are normalised and the path is not; it is scaled to the height, so that
    after division it is the source's.
    """
    x, y, z = places.mean(2).unbind(-1)
    cos, sin = batch["turn"].unbind(-1)
    mean = torch.stack([x * cos + z * sin, y, z * cos - x * sin], -1)
    return mean / heights[:, None, None] + batch["path"] / batch["source"]["heights"][:, None, None]
