"""NKN and SMRM trained in bfloat16 on the CPU: nearly the same losses, and nothing stored in fewer bits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import nkn_toys
import numpy as np
import pytest
import smrm_material
import torch
import training_material

from retarget_bench.methods.nkn import Nkn
from retarget_bench.training.config import Precision, TrainingConfig
from retarget_bench.training.phases import OptimiserPhase, optimiser_phases

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
