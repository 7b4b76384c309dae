"""Training batches, windows of two structures at a time, and the statistics of all clips."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from retarget_bench.motion import facing
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.normaliser import statistics
from retarget_bench.training.layers.skeletal.body import LayoutBody
from retarget_bench.training.layers.skeletal.features import Features
from retarget_bench.training.layers.skeletal.structure import StructureNetworks

CONSTANT = 1e-5
"""A channel with a smaller deviation is taken for constant and not scaled (released code)."""
BODIES = ("which", "bones", "unit", "turn")
"""Entries of a batch for the bodies of its rows, see ``Windows.draw``."""


class Windows:
    """Batches of two sides, each of one structure with as many rows; of one side where there is one
    structure.

    end_sites: joints of each structure whose end sites are among the bones.

    A clip that is shorter than a window is played to its end and back.
    """

    def __init__(
        self,
        training_data: TrainingData,
        frames: int,
        bodies: Mapping[str, Mapping[str, LayoutBody]],
        end_sites: Mapping[str, Sequence[int]],
        features: Features,
        backwards: bool,
        by_character: bool,
    ) -> None:
        self._material, self._frames, self._features = training_data, frames, features
        self._backwards, self._by_character = backwards, by_character
        self._names, self._bodies, self._end_sites = sorted(bodies), bodies, end_sites
        self._casts = {name: sorted(bodies[name]) for name in self._names}

    def draw(self, numbers: np.random.Generator, rows: int) -> dict[str, Any]:
        """``sides``, each with

        structure: its number. edges ``(rows, frames, edges + 1, 4)``; turn ``(rows, frames, 2)`` where the
        body faces, from the window's first frame on; which ``(rows,)`` the row of its statistics; bones
        ``(rows, edges + 1 + end sites, 3)``; unit ``(rows,)`` in heights.
        targets: which, bones, unit and turn of the bodies here that take each side's motion, then its own.
        """
        count = min(2, len(self._names))
        chosen = sorted(numbers.choice(len(self._names), count, replace=False).tolist())
        size = max(rows // count, 1)
        sides: list[dict[str, Any]] = []
        for number in chosen:
            name = self._names[number]
            cast = self._material.cast(numbers, size, self._casts[name])
            sides.append({"structure": number, **self._window(numbers, cast), **self._of(name, cast)})
        for side, number in zip(sides, chosen, strict=True):
            name = self._names[number]
            bodies = [
                self._of(name, self._material.cast(numbers, size, self._casts[name])) for _ in range(count)
            ]
            requests = [{**each, "turn": other["turn"]} for each, other in zip(bodies, sides, strict=True)]
            side["targets"] = {
                key: np.concatenate([each[key] for each in (*requests, side)]) for key in BODIES
            }
        return {"sides": sides}

    def speeds(self, name: str) -> Tensor:
        """``(2,)`` the slowest and the fastest movement of the hips (eq. 20)."""
        root = self._material.stacked("edges", self._casts[name])[:, -1, :3]
        if self._features.root == "height":
            root = root[:, [0, 2]]
        speed = np.linalg.norm(root, axis=-1)
        return torch.tensor([speed.min(), speed.max()])

    def _of(self, name: str, cast: Sequence[str]) -> dict[str, np.ndarray]:
        bodies, features = [self._bodies[name][one] for one in cast], self._features
        rows = [1 + self._casts[name].index(one) if self._by_character else 0 for one in cast]
        units = [features.unit(each.character) / each.character.height for each in bodies]
        return {
            "which": np.array(rows),
            "bones": np.stack([features.bones(each, self._end_sites[name]) for each in bodies]),
            "unit": np.array(units, dtype=np.float32),
        }

    def _window(self, numbers: np.random.Generator, cast: Sequence[str]) -> dict[str, np.ndarray]:
        """``edges`` and ``turn`` of a window per character."""
        windows = self._material.draw(numbers, cast, self._frames)
        back = (numbers.random(len(cast)) < 0.5) & self._backwards
        edges = windows.arrays["edges"].copy()
        turn = windows.arrays["turn"][..., 0] + 1j * windows.arrays["turn"][..., 1]
        for row in np.flatnonzero(back | (windows.lengths < self._frames)):
            order = _order(int(windows.lengths[row]), self._frames, bool(back[row]))
            edges[row], turn[row] = edges[row, order], turn[row, order]
            edges[row, :, -1] = self._features.root_of(windows.arrays["hips"][row, order], turn[row])
        turn = turn * turn[:, :1].conj()
        return {
            "edges": edges.astype(np.float32, copy=False),
            "turn": facing.parts(turn).astype(np.float32),
        }


def _order(available: int, frames: int, backwards: bool) -> np.ndarray:
    """``(frames,)`` indices of ``available`` frames, to the end, back, and to the end again."""
    around = np.concatenate([np.arange(available), np.arange(available - 2, 0, -1)])
    order = np.resize(around, frames)
    return order[::-1] if backwards else order


def fit_statistics(
    structure: StructureNetworks, training_data: TrainingData, cast: Sequence[str], least_deviation: float
) -> None:
    """Set mean and deviation of all motion of a structure, and of each character of its ``cast``."""
    for row, names in enumerate([list(cast), *([name] for name in structure.cast)]):
        mean, deviation = statistics_of(training_data.stacked("edges", names), least_deviation)
        structure.mean[row], structure.deviation[row] = mean, deviation


def statistics_of(edges: np.ndarray, least_deviation: float) -> tuple[Tensor, Tensor]:
    """Mean and deviation ``(edges + 1, 4)`` of ``(frames, edges + 1, 4)``; still: the least deviation."""
    mean, deviation = statistics(edges, CONSTANT, least_deviation)
    return torch.from_numpy(mean).float(), torch.from_numpy(deviation).float()
