"""Training steps on a GPU: nothing is left on the CPU, and next to no step waits for the device.

Without a GPU, steps go through torch's ``meta`` device, which holds no numbers. Modes on top of it raise at
what mixes devices, and note what asks for a number or copies from the CPU, since each of these waits.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import nkn_toys
import numpy as np
import pytest
import smrm_material
import torch
import training_material
from learned_methods import LEARNED
from torch import Tensor
from torch.overrides import TorchFunctionMode
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves

from retarget_bench.methods.nkn import Nkn
from retarget_bench.plugins import registry
from retarget_bench.training.config import Precision, TrainingConfig
from retarget_bench.training.phases import OptimiserPhase, optimiser_phases, to_device

CUDA = pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU")
WAITS = 3
"""How often a step may wait for the device."""
REPOSITORY = Path(__file__).parents[2]


@pytest.fixture
def module(request: pytest.FixtureRequest) -> Any:
    return LEARNED[request.param].module()


NUMBERS: Mapping[Any, Callable[[Tensor], Any]] = {
    Tensor.item: lambda _: 1.0,
    Tensor.tolist: lambda tensor: np.ones(tensor.shape).tolist(),
    Tensor.cpu: lambda tensor: torch.ones(tensor.shape, dtype=tensor.dtype),
    Tensor.__bool__: lambda _: True,
    Tensor.__int__: lambda _: 1,
    Tensor.__index__: lambda _: 1,
    Tensor.__float__: lambda _: 1.0,
}
"""What a step asks a tensor for, and the answer that it gets from a device without numbers."""


def line() -> str:
    """The line of a method, or of what methods share, that is being carried out."""
    frame: Any = sys._getframe()
    while frame:
        place = Path(frame.f_code.co_filename)
        if any(place.is_relative_to(REPOSITORY / folder) for folder in ("methods", "retarget_bench")):
            return f"{place.relative_to(REPOSITORY)}:{frame.f_lineno}"
        frame = frame.f_back
    return "?"


class Asking(TorchFunctionMode):
    """Notes what asks for numbers, and what copies numbers of Python: new tensors, and lists of indices."""

    def __init__(self, waits: list[str]) -> None:
        super().__init__()
        self.found = waits

    def __torch_function__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        if func in NUMBERS and args[0].is_meta:
            self.found.append(f"{line()}: {func.__name__}")
            return NUMBERS[func](args[0])
        result = func(*args, **(kwargs or {}))
        if func in (torch.tensor, torch.as_tensor, Tensor.new_tensor) and result.is_meta:
            self.found.append(f"{line()}: {func.__name__}")
        if func in (Tensor.__getitem__, Tensor.__setitem__) and args[0].is_meta:
            index = args[1] if isinstance(args[1], tuple) else (args[1],)
            if any(isinstance(each, list | np.ndarray) for each in index):
                self.found.append(f"{line()}: {func.__name__}")
        return result


class OneDevice(TorchDispatchMode):
    """Raises where an operation mixes devices, and notes copies from one to another that are waited for, of
    indices too; single numbers may come from the CPU."""

    def __init__(self, waits: list[str]) -> None:
        super().__init__()
        self.found = waits

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        result, kwargs = func(*args, **(kwargs or {})), kwargs or {}
        tensors = [each for each in tree_leaves((args, kwargs, result)) if isinstance(each, Tensor)]
        devices = {each.device.type for each in tensors if each.ndim}
        if len(devices) > 1 and not kwargs.get("non_blocking"):
            message = f"{line()}: {func}"
            assert "copy" in str(func) or "index" in str(func), (
                f"{message} is of {', '.join(sorted(devices))}"
            )
            self.found.append(message)
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


@pytest.mark.parametrize("module", LEARNED, indirect=True)
def test_next_to_no_step_waits_for_the_device_and_none_mixes_it_with_the_cpu(module: Any) -> None:
    meta = torch.device("meta")
    for part in module.modules.modules():
        if hasattr(part, "_full"):  # a buffer asks until it is full
            part._full, part._count = True, len(part.kept)
    module.modules.to(meta)
    with without_autocast():
        for _ in range(2):  # constants are moved with the first step
            batch, waits = drawn(module, meta), []
            with Asking(waits), OneDevice(waits):
                step(module, batch)
    assert len(waits) <= WAITS, "\n".join(waits)


def test_no_method_that_can_be_trained_is_left_out() -> None:
    plugins, _ = registry.working("methods")
    trained = {name for name, each in plugins.items() if hasattr(each, "training_module")}
    assert trained == {name.partition("[")[0] for name in LEARNED}


# ------------------------------------------------------------------------------------------ with a GPU
@CUDA
@pytest.mark.parametrize("module", LEARNED, indirect=True)
def test_losses_are_those_of_the_cpu(module: Any) -> None:
    here = drawn(module, torch.device("cpu"))
    module.modules.eval()
    with torch.no_grad():
        expected = module.losses(module.phases[0].name, here, {})
        cuda = torch.device("cuda")
        module.modules.to(cuda)
        losses = module.losses(module.phases[0].name, to_device(here, cuda), {})
    for name, term in expected.items():
        torch.testing.assert_close(losses[name].cpu(), term, rtol=1e-3, atol=1e-5)


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


@CUDA
@pytest.mark.parametrize("precision", ["float32", "bfloat16"])
@pytest.mark.parametrize("module", LEARNED, indirect=True)
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


# ---------------------------------------------------------------------------------------- reduced precision
STEPS = 3
LEARNERS: dict[str, Callable[[], Any]] = {
    "smrm": smrm_material.training_module,
    "nkn, TensorFlow's cell": lambda: nkn_toys.training_module(Nkn(hidden=16)),
    "nkn, torch's cell": lambda: nkn_toys.training_module(Nkn(hidden=16, cell="torch")),
}


def trained(
    learner: Callable[[], Any], precision: Precision
) -> tuple[list[dict[str, float]], Any, list[OptimiserPhase]]:
    """What steps as the loop does them measure, the learner, and its optimisers."""
    module = learner()
    config = TrainingConfig(steps=STEPS, batch=4, window=16, rate=1e-3, precision=precision)
    phases, history = optimiser_phases(module, config, torch.device("cpu")), []
    for step in range(STEPS):
        torch.manual_seed(step)
        batch, memory, measured = training_material.batch(module, 4, step), {}, {}
        for phase in phases:
            measured |= phase(batch, memory, config.rate)
        history.append({name: float(value) for name, value in measured.items()})
    return history, module, phases


@pytest.mark.parametrize("name", LEARNERS)
def test_losses_are_nearly_those_of_single_precision(name):
    """Numbers of bfloat16 have eight bits; drawn numbers are the same in both, and so is dropout."""
    full, _, _ = trained(LEARNERS[name], "float32")
    mixed, module, phases = trained(LEARNERS[name], "bfloat16")
    assert full != mixed
    for one, other in zip(full, mixed, strict=True):
        assert one.keys() == other.keys()
        terms = [each for each in one if not each.endswith(".norm")]
        np.testing.assert_allclose(
            [other[each] for each in terms], [one[each] for each in terms], rtol=0.03, atol=1e-6
        )
        assert np.isfinite(list(other.values())).all()
    tensors = [*module.modules.state_dict().values(), *module.export().values()]
    tensors += [value for phase in phases for value in phase.state().values()]
    assert {each.dtype for each in tensors if each.is_floating_point()} == {torch.float32}
