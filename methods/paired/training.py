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
from .augmentation import mirrored, mirrored_bones, missing, reposed, spare, turns, without
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
"""Share of rows whose floor is not at zero, as in many files, and its standard deviation in heights of the
hips."""


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
        """Windows of performances: ``motion`` of the ``source``, ``truth`` of the ``target``."""
        at = np.searchsorted(self._ends, numbers.integers(self._ends[-1], size=rows), "right")
        pairs = [self._pair(numbers, self._performances[number]) for number in at]
        starts = [int(numbers.integers(max(one.frames - self._window, 0) + 1)) for one, _ in pairs]
        frames = [one.frames - start for (one, _), start in zip(pairs, starts, strict=True)]
        flip = torch.from_numpy(numbers.random(rows) < 0.5)
        same = torch.tensor([one is other for one, other in pairs])
        lifts = LIFT * numbers.standard_normal((rows, 1)) * (numbers.random((rows, 1)) < LIFTED)
        batch: dict[str, dict[str, Tensor]] = {}
        before: tuple[Tensor, Tensor] | None = None
        for clips, (motion, body) in zip(
            zip(*pairs, strict=True), (("motion", "source"), ("truth", "target")), strict=True
        ):
            motions = self._cut(clips, starts)
            offsets, lengths = (
                torch.from_numpy(np.stack(each))
                for each in zip(*(self._bodies[clip.character] for clip in clips), strict=True)
            )
            lacks = torch.from_numpy(np.stack([missing(spare(numbers)) for _ in clips]))
            pose = turns(numbers, rows)
            if before is not None:  # a body that is its own target has one shape
                lacks, pose = where(same, before[0], lacks), where(same, before[1], pose)
            before = lacks, pose
            images = mirrored(motions)
            motions = {key: where(flip, images[key], each) for key, each in motions.items()}
            offsets = where(flip, mirrored_bones(offsets), offsets)
            motions["rotations"], offsets = reposed(motions["rotations"], offsets, pose)
            motions, offsets = without(motions, offsets, lacks)
            lifted = lengths[:, 1:] * torch.from_numpy(lifts).float()
            motions["hips"][..., 1] += lifted
            batch[motion], batch[body] = motions, {"offsets": offsets, "lengths": lengths}
        real = torch.arange(self._window) < torch.tensor(frames)[:, None]
        arrays = {**batch, "real": {"frames": real}}
        return {key: {name: each.numpy() for name, each in part.items()} for key, part in arrays.items()}

    @staticmethod
    def _pair(numbers: np.random.Generator, clips: Sequence[ClipArrays]) -> tuple[ClipArrays, ClipArrays]:
        """The performance by two bodies, now and then by one twice."""
        first = int(numbers.integers(len(clips)))
        second = (first + 1 + int(numbers.integers(len(clips) - 1))) % len(clips)
        return clips[first], clips[first if numbers.random() < SAME else second]

    def _cut(self, clips: Sequence[ClipArrays], starts: Sequence[int]) -> dict[str, Tensor]:
        """Windows of clips, the last frame again up to their end."""
        cuts = {}
        for key, first in clips[0].arrays.items():
            windows = np.empty((len(clips), self._window, *first.shape[1:]), np.float32)
            for window, clip, start in zip(windows, clips, starts, strict=True):
                part = clip.arrays[key][start : start + self._window]
                window[: len(part)], window[len(part) :] = part, part[-1]
            cuts[key] = torch.from_numpy(windows)
        return cuts

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


def where(rows: Tensor, chosen: Tensor, others: Tensor) -> Tensor:
    """Of two batches the chosen one's rows ``(rows,)`` bool, and the other's elsewhere."""
    return torch.where(rows.view(-1, *(1,) * (chosen.ndim - 1)), chosen, others)
