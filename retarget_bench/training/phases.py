"""One phase of a step: losses, gradients, and the optimiser that takes them."""

import math
import os
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.errors import BenchError
from retarget_bench.training import parallel
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Batch, Phase, Terms, TrainingModule

NORM = "norm"
"""The name of the gradient's norm beside a phase's terms."""


class OptimiserPhase:
    """One phase with its optimiser."""

    def __init__(
        self, module: TrainingModule, phase: Phase, config: TrainingConfig, device: torch.device
    ) -> None:
        self.name, self.phase = phase.name, phase
        self.parameters = {
            f"{name}.{key}": parameter
            for name in phase.modules
            for key, parameter in module.modules[name].named_parameters()
            if parameter.requires_grad
        }
        if not self.parameters:
            raise BenchError(f"phase {phase.name} has no parameters to train: {', '.join(phase.modules)}")
        self._all = [each for each in module.modules.parameters() if each.requires_grad]
        self._device = device
        self._mixed = config.precision == "bfloat16"
        self.optimiser = torch.optim.Adam(
            self.parameters.values(), lr=config.rate * phase.rate, betas=phase.betas, fused=True
        )
        self._losses: nn.Module = _Losses(module, phase)
        if parallel.world() > 1:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FutureWarning)  # torch 2.4 does not know the new name
                # no device_ids: inputs stay the very objects that they are, so that a phase can leave
                # something in memory
                self._losses = nn.parallel.DistributedDataParallel(
                    self._losses, broadcast_buffers=False, find_unused_parameters=True
                )

    def __call__(self, batch: Batch, memory: dict[str, Any], rate: float) -> dict[str, Tensor]:
        """Update the phase's modules once. ``phase.term`` -> its value, and the gradient's norm; empty
        where the training module leaves the phase out."""
        own = set(map(id, self.parameters.values()))
        for parameter in self._all:  # only this phase's take gradients
            parameter.requires_grad_(id(parameter) in own)
        with torch.autocast(self._device.type, torch.bfloat16, enabled=self._mixed):
            terms = cast(Terms, self._losses(batch, memory))
        if not terms:
            return {}
        self.optimiser.zero_grad(set_to_none=True)
        torch.stack([term.float() for term in terms.values()]).sum().backward()  # type: ignore[no-untyped-call]
        norm = nn.utils.clip_grad_norm_(self.parameters.values(), self.phase.clip or math.inf)
        for group in self.optimiser.param_groups:
            group["lr"] = rate * self.phase.rate
        self.optimiser.step()
        return {f"{self.name}.{key}": term.detach().float() for key, term in terms.items()} | {
            f"{self.name}.{NORM}": norm.detach().float()
        }

    def state(self) -> dict[str, Tensor]:
        """``parameter/entry`` -> what the optimiser keeps of it."""
        state = self.optimiser.state_dict()["state"]
        return {
            f"{name}/{entry}": value
            for number, name in enumerate(self.parameters)
            for entry, value in state.get(number, {}).items()
        }

    def restore(self, state: Mapping[str, Tensor]) -> None:
        """Take over what ``state`` gave."""
        numbers = {name: number for number, name in enumerate(self.parameters)}
        entries: dict[int, dict[str, Tensor]] = {}
        for key, value in state.items():
            name, _, entry = key.rpartition("/")
            entries.setdefault(numbers[name], {})[entry] = value
        groups = self.optimiser.state_dict()["param_groups"]
        self.optimiser.load_state_dict({"state": entries, "param_groups": groups})


class _Losses(nn.Module):
    """A phase's losses as a module that owns what the phase updates, and nothing else."""

    def __init__(self, module: TrainingModule, phase: Phase) -> None:
        super().__init__()
        self.trained = nn.ModuleDict({name: module.modules[name] for name in phase.modules})
        self._name = phase.name
        self._held = (module,)  # in a tuple: one that is an ``nn.Module`` must not be registered here

    def forward(self, batch: Batch, memory: dict[str, Any]) -> Terms:
        return self._held[0].losses(self._name, batch, memory)


def optimiser_phases(
    module: TrainingModule, config: TrainingConfig, device: torch.device
) -> list[OptimiserPhase]:
    """An optimiser for each phase. Raises BenchError where phases and modules do not fit together."""
    owners: dict[str, str] = {}
    for phase in module.phases:
        for name in phase.modules:
            if name not in module.modules:
                raise BenchError(f"phase {phase.name} updates {name!r}, which it has no module for")
            if name in owners and parallel.world() > 1:
                raise BenchError(
                    f"{name} is updated by the phases {owners[name]} and {phase.name}; such a method can "
                    "be trained by one process only"
                )
            owners[name] = phase.name
    return [OptimiserPhase(module, phase, config, device) for phase in module.phases]


def to_device(batch: Any, device: torch.device) -> Any:
    """A batch on the device: arrays and tensors in nested mappings and sequences; all else as it is."""
    if isinstance(batch, np.ndarray):
        batch = torch.from_numpy(batch) if batch.dtype.kind in "biuf" else batch
    if isinstance(batch, Tensor):
        if device.type == "cuda" and batch.device.type == "cpu":
            return batch.pin_memory().to(device, non_blocking=True)
        return batch.to(device)
    if isinstance(batch, Mapping):
        return {key: to_device(value, device) for key, value in batch.items()}
    if isinstance(batch, Sequence) and not isinstance(batch, str):
        parts = [to_device(value, device) for value in batch]
        if isinstance(batch, tuple) and hasattr(batch, "_fields"):
            return type(batch)(*parts)
        return tuple(parts) if isinstance(batch, tuple) else parts
    return batch


def set_deterministic(device: torch.device) -> None:
    """Say what torch may do on a GPU: no TF32, since places are chains of products of rotations, and the
    same algorithm every time. Reduced precision is the recipe's choice, by autocast."""
    torch.backends.cuda.matmul.allow_tf32 = False
    torch.backends.cudnn.allow_tf32 = False
    if device.type == "cuda":
        os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")  # or its sums change from run to run
        torch.backends.cudnn.benchmark = False
        torch.backends.cudnn.deterministic = True
