"""NPT while it is trained: one frame of a performance by two bodies in each row."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.errors import NotSupported
from retarget_bench.motion.scan_path import centre
from retarget_bench.motion.surface_sampling import sampled
from retarget_bench.training import weights
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.layers import exported

from .network import PoseTransfer
from .surfaces import Skin

EDGES = 5e-4
"""Weight of the edge length regularisation (in the published code 1e-3)."""
_SHORTEST = 1e-12
"""Square units added under a root, whose slope is infinite at 0."""


class NptTraining:
    """A ``TrainingModule`` (see ``training/contract.py``)."""

    def __init__(
        self,
        training_data: TrainingData,
        points: int,
        network: PoseTransfer,
        trained: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        """points: of each body in a row of a batch, or as many as the coarsest mesh has. trained: makes the
        method from exported tensors. Raises NotSupported where no clip is performed by two bodies."""
        by_clip: dict[str, list[ClipArrays]] = {}
        for clips in training_data.clips.values():
            for clip in clips:
                by_clip.setdefault(clip.name, []).append(clip)
        self._performances = [clips for clips in by_clip.values() if len(clips) > 1]
        if not self._performances:
            raise NotSupported("npt learns from the same performance by two bodies, and there is none")
        self._ends = np.cumsum([clips[0].frames for clips in self._performances])
        self._skins = {name: Skin(training_data.characters[name]) for name in training_data.clips}
        fewest = min(len(skin.identity.vertices) for skin in self._skins.values())
        self._points = min(points, fewest)
        self._trained = trained
        self.network = network
        self.modules = nn.ModuleDict({"network": network})
        self.phases: Sequence[Phase] = (Phase("network", ("network",), clip=1.0),)

    # ---------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        drawn = [self._row(numbers) for _ in range(rows)]
        return {name: np.stack([row[name] for row in drawn]) for name in drawn[0]}

    def _row(self, numbers: np.random.Generator) -> dict[str, np.ndarray]:
        """One frame: points of the one body, vertices of the other at rest and in its pose, in an order of
        their own, and its edges between these vertices."""
        at = int(numbers.integers(self._ends[-1]))
        number = int(np.searchsorted(self._ends, at, side="right"))
        clips = self._performances[number]
        frame = at - int(self._ends[number - 1] if number else 0)
        source, target = (clips[k] for k in numbers.choice(len(clips), 2, replace=False))
        giver, taker = self._skins[source.character], self._skins[target.character]
        skin = giver.posed(source.arrays, frame)[None]
        points = sampled(skin, giver.body.faces, numbers.random((1, 3, self._points)))[0]
        posed = taker.posed(target.arrays, frame)
        scale, resting = taker.identity.scale, taker.identity.vertices
        chosen = numbers.permutation(len(resting))[: self._points]
        edges, real = self._edges(numbers, taker, chosen)
        row = {
            "points": scale * (points - centre(points)),
            "identity": scale * resting[chosen],
            "truth": scale * (posed - centre(posed))[chosen],
        }
        row = {name: each.astype(np.float32) for name, each in row.items()}
        return {**row, "edges": edges, "real": real}

    def _edges(
        self, numbers: np.random.Generator, skin: Skin, chosen: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """``(points, 2)`` edges between the vertices that are kept, by their places among these, and
        ``(points,)`` whether there are so many."""
        place = np.full(len(skin.body.weights), -1)
        place[chosen] = np.arange(len(chosen))
        edges = place[skin.edges]
        edges = numbers.permutation(edges[(edges >= 0).all(axis=1)])[: self._points]
        real = np.arange(self._points) < len(edges)
        padded = np.zeros((self._points, 2), dtype=np.int64)
        padded[: len(edges)] = edges
        return padded, real

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        del phase, memory
        answer = self.network(batch["points"], batch["identity"]).float()
        with torch.autocast(answer.device.type, enabled=False):
            return {
                "vertices": (answer - batch["truth"]).square().mean(),
                "edges": EDGES * stretch(answer, batch["identity"], batch["edges"], batch["real"]),
            }

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._trained(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return exported(self.network)

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        weights.fill(self.network, tensors)


def stretch(answer: Tensor, identity: Tensor, edges: Tensor, real: Tensor) -> Tensor:
    """The mean over edges of how far the ratio of the length in the answer to that at rest is from 1;
    the paper's edge length regularisation, which keeps vertices from flying off.

    answer, identity: ``(rows, points, 3)``. edges: ``(rows, edges, 2)`` points. real: ``(rows, edges)``.
    """
    lengths = [_lengths(each, edges) for each in (answer, identity)]
    off = (lengths[0] / lengths[1] - 1.0).abs() * real
    return off.sum() / real.sum().clamp(min=1)


def _lengths(points: Tensor, edges: Tensor) -> Tensor:
    rows = torch.arange(len(points), device=points.device)[:, None]
    apart = points[rows, edges[..., 0]] - points[rows, edges[..., 1]]
    return (apart.square().sum(dim=-1) + _SHORTEST).sqrt()
