"""Training of networks by structure: windows of two of them a step, statistics, discriminators, weights."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.skeletal.body import LayoutBody
from retarget_bench.training.layers.skeletal.discriminators import Discriminators
from retarget_bench.training.layers.skeletal.features import Features
from retarget_bench.training.layers.skeletal.layout import Layout
from retarget_bench.training.layers.skeletal.structure import (
    StructureNetworks,
    by_structure,
    matching,
    named,
)
from retarget_bench.training.layers.skeletal.windows import Windows, fit_statistics

Networks = TypeVar("Networks", bound=StructureNetworks)
Bodies = Mapping[str, Mapping[str, LayoutBody]]
"""Structure -> character -> its body."""
Side = Mapping[str, Any]
"""One structure's part of a batch: see ``Windows.draw``."""


class TrainingSettings(Protocol):
    """The part of a method's settings that its training reads.

    statistics: mean and deviation by ``structure`` or by ``character``; deviations are ``least_deviation``
    or more. shared: structures begin with the same weights for what they have in common.
    """

    @property
    def features(self) -> Features: ...
    @property
    def statistics(self) -> str: ...
    @property
    def least_deviation(self) -> float: ...
    @property
    def shared(self) -> bool: ...


class SkeletalTraining(ABC, Generic[Networks]):
    """A ``TrainingModule`` (see ``training/contract.py``).

    build: the method with the tensors that it is given. windows: where batches come from.
    """

    def __init__(
        self,
        training_data: TrainingData,
        bodies: Bodies,
        settings: TrainingSettings,
        build: Callable[[Mapping[str, Tensor]], Method],
        windows: Windows,
    ) -> None:
        self._build, self._windows, self._names = build, windows, sorted(bodies)
        self._structures: dict[str, Networks] = {}
        for name in self._names:
            cast = sorted(bodies[name])
            layout = next(iter(bodies[name].values())).layout
            structure = self._networks(layout, cast if settings.statistics == "character" else ())
            fit_statistics(structure, training_data, cast, settings.least_deviation)
            self._structures[name] = structure
        if settings.shared:
            self._share_initialisation(list(self._structures.values()))
        self.modules = nn.ModuleDict({"generator": nn.ModuleDict(self._structures)})
        self.phases: Sequence[Phase] = (Phase("generator", ("generator",)),)

    def _judge(self, discriminators: Discriminators, weight: float) -> None:
        """Train discriminators too, in a phase after the generator's, where the adversarial loss has a
        weight."""
        self._discriminators = discriminators
        if weight > 0:
            self.modules["discriminator"] = discriminators
            self.phases = (*self.phases, Phase("discriminator", ("discriminator",)))

    @abstractmethod
    def _networks(self, layout: Layout, cast: Sequence[str]) -> Networks:
        """New networks of a structure."""

    @abstractmethod
    def _share_initialisation(self, structures: Sequence[Networks]) -> None:
        """Copy the first structure's initial weights to the others, where they have the same meaning."""

    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        return self._windows.draw(numbers, rows)

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        if phase == "discriminator":
            return self._discriminators.loss(memory["shown"])
        return self._generate(batch["sides"], memory)

    @abstractmethod
    def _generate(self, sides: Sequence[Side], memory: dict[str, Any]) -> Terms:
        """The generator's terms. ``memory["shown"]`` gets what ``Discriminators.loss`` takes."""

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._build(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return named(self._structures)

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        """Take over weights, also of another data set: structures are matched by their joints. Statistics
        stay those of this training's motion, which may be wider than what the weights have seen.

        Raises BenchError where one is missing or does not fit."""
        structures = by_structure(tensors)
        matches = {name: matching(each, name, structures) for name, each in self._structures.items()}
        for name, structure in self._structures.items():
            fitted = structure.mean.clone(), structure.deviation.clone()
            structure.load(matches[name])
            structure.mean, structure.deviation = fitted
