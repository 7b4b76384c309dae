"""Contracts of trainable methods and of their training modules.

The loop belongs to the engine (``loop.py``): it draws batches, runs the phases of a training module in
their order, steps the optimisers, validates with the benchmark's own metrics, keeps checkpoints and the
best weights. A training module owns what is trained: modules, losses, and whatever it remembers from step
to step (statistics, replay buffers, running scores), all of it in modules' parameters and buffers, so that
a checkpoint is whole.
"""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData

Batch = Mapping[str, Any]
"""Name -> array or tensor, nested mappings allowed; the loop moves it to the device as it is."""
Terms = Mapping[str, Tensor]
"""Name of a loss term -> its value, already weighted: what is minimised is the sum."""


@dataclass(frozen=True)
class Phase:
    """One optimiser's update in every step.

    name:    ``generator``, ``discriminator``, ... modules: of ``TrainingModule.modules``, what it updates;
             all other modules' parameters are frozen while its losses are computed.
    rate:    its learning rate as a multiple of the config's. clip: largest norm of its gradient, 0: none.
    """

    name: str
    modules: tuple[str, ...]
    rate: float = 1.0
    betas: tuple[float, float] = (0.9, 0.999)
    clip: float = 0.0


class TrainingModule(Protocol):
    """A method while it is trained.

    Where several processes train together, parameters and buffers are the same in all of them: after every
    step the first one's buffers become everybody's. A running score is better the mean over processes
    (``parallel.mean``).
    """

    modules: nn.ModuleDict
    phases: Sequence[Phase]

    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        """One process's batch of ``rows`` rows, from the material and ``numbers`` alone: the same numbers
        always give the same batch. On a GPU it is called in forked processes: what is counted in an earlier
        step must not matter, and no tensor of the device be touched."""

    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        """The terms of a phase, the same names on every process; none at all: the phase is left out of
        this step, on every process.

        memory: empty at the start of a step; what an earlier phase of the step leaves there (detached
        outputs), a later one may use.
        """

    def method(self) -> Method:
        """The method with the weights as they are now, for validation; training mode is left alone."""

    def export(self) -> Mapping[str, Tensor]:
        """The tensors that retargeting needs, for a bundle: weights and statistics, nothing else."""

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        """Take over exported tensors (``bench train --init``). Raises BenchError where they do not fit."""


class Trainable(Method):
    """A method that ``bench train`` can train.

    presets: ``default`` at least; built-in methods also have ``paper``. ``gpu`` and ``quick`` are made of
    the default one (``config.presets``) where a method has none of its own.
    """

    presets: Mapping[str, TrainingConfig]

    @abstractmethod
    def unfit(self, character: Character) -> str:
        """Reason why a character cannot be trained on, as a sentence; "" where it can."""

    @abstractmethod
    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        """A training clip at the recipe's rate as arrays ``(frames, ...)`` float32, run in a worker."""

    @abstractmethod
    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> TrainingModule:
        """A new training module; random numbers come from torch's generator, which the loop has seeded.

        Raises NotSupported where the material is not enough (no two characters, a missing structure)."""

    @abstractmethod
    def facts(self) -> Mapping[str, str | int | float | bool]:
        """The parameters that weights depend on: another value needs other weights."""
