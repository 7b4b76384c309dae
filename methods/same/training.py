"""SAME while it is trained: short windows of one performance by two bodies."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.errors import NotSupported
from retarget_bench.training import weights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.normaliser import statistics

from . import losses
from .bodies import body
from .features import CONTACT, INPUTS, ROOT
from .graph import Graphs, Nodes
from .network import Autoencoder

CUT, DEEPEST = 0.5, 4
"""Share of bodies that lose the end of a limb, and how many nodes of it at most."""
SAMPLED = 20_000
"""Frames, about, that means and deviations are taken of."""
LEAST = 1e-3
"""What varies less is not blown up."""


class SameTraining:
    """A ``TrainingModule`` (see ``training/contract.py``)."""

    def __init__(
        self,
        training_data: TrainingData,
        config: TrainingConfig,
        network: Autoencoder,
        trained: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        """trained: makes the method from exported tensors. Raises NotSupported where no clip as long as a
        window is performed by two bodies."""
        by_clip: dict[str, list[ClipArrays]] = {}
        for clips in training_data.clips.values():
            for clip in clips:
                if clip.frames >= config.window:
                    by_clip.setdefault(clip.name, []).append(clip)
        self._performances = [clips for clips in by_clip.values() if len(clips) > 1]
        if not self._performances:
            raise NotSupported("same learns from the same performance by two bodies, and there is none")
        self._ends = np.cumsum([len(clips[0].starts(config.window)) for clips in self._performances])
        self._nodes = {name: Nodes.of(body(each)) for name, each in training_data.characters.items()}
        self._window, self._trained = config.window, trained
        self.network = network
        self._fit()
        self.modules = nn.ModuleDict({"network": network})
        self.phases: Sequence[Phase] = (Phase("network", ("network",), clip=0.5),)

    def _fit(self) -> None:
        """Means and deviations of some frames of all clips."""
        clips = [clip for clips in self._performances for clip in clips]
        step = max(sum(clip.frames for clip in clips) // SAMPLED, 1)
        frames = [clip.arrays["nodes"][::step] for clip in clips]
        mean, deviation = statistics(
            np.concatenate([each.reshape(-1, INPUTS) for each in frames]), least=LEAST
        )
        mean[ROOT], deviation[ROOT] = statistics(
            np.concatenate([each[:, 0, ROOT] for each in frames]), least=LEAST
        )
        mean[CONTACT], deviation[CONTACT] = 0.0, 1.0
        scale = self.network.scale
        scale.fit(
            "shape", np.concatenate([self._nodes[clip.character].shape for clip in clips]), least=LEAST
        )
        scale.get_buffer("pose_mean").copy_(torch.from_numpy(mean))
        scale.get_buffer("pose_deviation").copy_(torch.from_numpy(deviation))

    # ---------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        """Windows of performances, ``source`` and ``target``, each with ``graphs`` (``Graphs``) and
        ``features`` ``(nodes, frames, 26)``."""
        drawn = [self._row(numbers) for _ in range(rows)]
        return {
            name: {
                "graphs": Graphs.of([nodes for nodes, _ in side]),
                "features": np.concatenate([features for _, features in side]),
            }
            for name, side in zip(("source", "target"), zip(*drawn, strict=True), strict=True)
        }

    def _row(self, numbers: np.random.Generator) -> list[tuple[Nodes, np.ndarray]]:
        """One performance by two of its bodies, which may be one; each may lack the end of a limb."""
        at = numbers.integers(self._ends[-1])
        clips = self._performances[int(np.searchsorted(self._ends, at, side="right"))]
        start = int(numbers.integers(len(clips[0].starts(self._window))))
        sides = []
        for clip in (clips[place] for place in numbers.integers(len(clips), size=2)):
            nodes = self._nodes[clip.character]
            chosen = cut(numbers, nodes.parents)
            features = clip.arrays["nodes"][start : start + self._window, chosen]
            sides.append((nodes.subset(chosen), features.swapaxes(0, 1)))
        return sides

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        del phase, memory
        source, target = batch["source"], batch["target"]
        codes, own = (self.network.encode(side["features"], side["graphs"]) for side in (source, target))
        output = self.network.decode(codes, target["graphs"])
        with torch.autocast(codes.device.type, enabled=False):
            answer = losses.answered(output, target["graphs"])
            truth = losses.performed(target["features"], target["graphs"])
            every = losses.terms(
                answer, truth, target["graphs"], self.network.scale.get_buffer("pose_deviation")[ROOT]
            )
        every["codes"] = (codes - own).float().square().mean()
        return {name: losses.WEIGHTS[name] * each for name, each in every.items()}

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._trained(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return exported(self.network)

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        weights.fill(self.network, tensors, "same")


def cut(numbers: np.random.Generator, parents: np.ndarray) -> np.ndarray:
    """The nodes that a body keeps, increasing: now and then not the last ones of a limb.

    parents: ``(nodes,)``. A limb ends above the next joint that something else hangs from.
    """
    kept = np.ones(len(parents), dtype=bool)
    if numbers.random() < CUT:
        hanging = np.bincount(parents[1:], minlength=len(parents))
        node = int(numbers.choice(np.flatnonzero(hanging == 0)))
        for _ in range(int(numbers.integers(1, DEEPEST + 1))):
            kept[node] = False
            node = int(parents[node])
            if node == 0 or hanging[node] > 1:
                break
    return np.flatnonzero(kept)
