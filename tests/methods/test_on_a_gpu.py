"""Training steps on a GPU: nothing is left on the CPU, and no step waits for the device.

Without a GPU, steps go through torch's ``meta`` device, which holds no numbers: whatever asks for one
raises, and a mode on top of it raises at what would mix devices or copy from one to the other.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import humot_material
import nkn_toys
import numpy as np
import pan_material
import pytest
import r2et_material
import san_material
import smrm_material
import torch
from test_paired import material, training
from torch import Tensor
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves

from retarget_bench.methods.nkn import plugin as Nkn
from retarget_bench.methods.paired.training import PairedTraining
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.phases import optimiser_phases, to_device

CUDA = pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU")
KINDS = ("pan", "pan[parts=three]", "san", "nkn", "smrm", "r2et", "paired")
"""``humot`` counts the joints of every row of a batch on the device."""
__all__ = ["material", "training"]


@pytest.fixture
def module(request: pytest.FixtureRequest, training: Any) -> Any:
    """The training module of a method, small."""
    match request.param:
        case "pan":
            return pan_material.training_module(small=True)
        case "pan[parts=three]":
            return pan_material.training_module(("one", "rex"), small=True, parts="three")
        case "san":
            return san_material.training_module()
        case "nkn":
            return nkn_toys.training_module(Nkn(hidden=16), window=6)
        case "smrm":
            return smrm_material.training_module(window=6)
        case "r2et":
            return r2et_material.training_module()
        case "humot":
            return humot_material.training_module(thin=True)
    return training


class OneDevice(TorchDispatchMode):
    """Raises where an operation mixes devices, or waits for a copy from one to another; single numbers may
    come from the CPU. indexed: joints may be chosen by lists, too, which torch copies."""

    def __init__(self, indexed: bool = False) -> None:
        super().__init__()
        self.indexed = indexed

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        result, kwargs = func(*args, **(kwargs or {})), kwargs or {}
        if kwargs.get("non_blocking") or (self.indexed and "index" in str(func)):
            return result
        tensors = [each for each in tree_leaves((args, kwargs, result)) if isinstance(each, Tensor)]
        devices = {each.device.type for each in tensors if each.ndim}
        assert len(devices) < 2, f"{func} is of {', '.join(sorted(devices))}"
        return result


@contextlib.contextmanager
def without_autocast() -> Iterator[None]:
    """The device that holds no numbers is not known to autocast."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(torch, "is_autocast_enabled", lambda *_: False)
        patch.setattr(torch, "autocast", lambda *_, **__: contextlib.nullcontext())
        yield


def step(module: Any, batch: Any) -> None:
    """Losses and gradients of all phases."""
    memory: dict[str, Any] = {}
    for phase in module.phases:
        terms = module.losses(phase.name, batch, memory)
        if terms:
            torch.stack(list(terms.values())).sum().backward()


def drawn(module: Any, device: torch.device, seed: int = 0) -> Any:
    return to_device(module.draw(np.random.default_rng(seed), 6), device)


@pytest.mark.parametrize("module", KINDS, indirect=True)
def test_no_step_asks_the_device_or_mixes_it_with_the_cpu(module: Any) -> None:
    meta = torch.device("meta")
    for part in module.modules.modules():
        if hasattr(part, "_full"):  # a buffer asks until it is full
            part._full, part._count = True, len(part.kept)
    module.modules.to(meta)
    for rule in module.modules.children():
        if hasattr(rule, "running"):  # who learns is asked for once a step
            rule.update = lambda logits, rule=rule: np.ones(len(rule.running), bool)
    batches = [drawn(module, meta, seed) for seed in range(2)]
    with without_autocast():
        step(module, batches[0])  # constants are moved with the first step
        with OneDevice(indexed=isinstance(module, PairedTraining)):
            step(module, batches[1])


# ------------------------------------------------------------------------------------------ with a GPU
@CUDA
@pytest.mark.parametrize("module", [*KINDS, "humot"], indirect=True)
def test_losses_are_those_of_the_cpu(module: Any) -> None:
    here = drawn(module, torch.device("cpu"))
    module.modules.eval()
    with torch.no_grad():
        wanted = module.losses(module.phases[0].name, here, {})
        cuda = torch.device("cuda")
        module.modules.to(cuda)
        found = module.losses(module.phases[0].name, to_device(here, cuda), {})
    for name, term in wanted.items():
        torch.testing.assert_close(found[name].cpu(), term, rtol=1e-3, atol=1e-5)


@CUDA
@pytest.mark.parametrize("precision", ["float32", "bfloat16"])
@pytest.mark.parametrize("module", [*KINDS, "humot"], indirect=True)
def test_steps_lower_the_loss(module: Any, precision: Any) -> None:
    cuda = torch.device("cuda")
    module.modules.to(cuda)
    config = TrainingConfig(steps=30, batch=6, window=16, rate=1e-3, precision=precision)
    phases = optimiser_phases(module, config, cuda)
    batch, losses = drawn(module, cuda), []
    for number in range(30):
        torch.manual_seed(number)
        memory: dict[str, Any] = {}
        measured = [phase(batch, memory, 1e-3) for phase in phases]
        losses.append(sum(float(x) for name, x in measured[0].items() if not name.endswith("norm")))
    assert np.mean(losses[-5:]) < np.mean(losses[:5])


@CUDA
@pytest.mark.parametrize("module", ["pan"], indirect=True)
def test_no_step_waits_for_the_device(module: Any) -> None:
    cuda = torch.device("cuda")
    module.modules.to(cuda)
    for seed in range(30):
        step(module, drawn(module, cuda, seed))
    batch = drawn(module, cuda)
    torch.cuda.set_sync_debug_mode("error")
    try:
        step(module, batch)
    finally:
        torch.cuda.set_sync_debug_mode("default")
