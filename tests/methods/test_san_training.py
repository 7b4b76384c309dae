"""SAN while it is trained: gradients, structures, that it learns, heights, its weights."""

from __future__ import annotations

import pytest
import san_material
import torch
import training_material
from san_material import BODIES, LEGS

from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.san import San
from retarget_bench.methods.san.losses import Heights, end_effectors
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.phases import optimiser_phases


def terms(module, batch):
    """Of both phases."""
    memory: dict = {}
    return {phase.name: module.losses(phase.name, batch, memory) for phase in module.phases}


def steps(module, count, batch=None, rate=1e-3):
    config = TrainingConfig(count, 4, san_material.WINDOW, rate, schedule="cosine")
    every = optimiser_phases(module, config, torch.device("cpu"))
    for step in range(count):
        torch.manual_seed(step)
        memory: dict = {}
        for phase in every:
            drawn = batch or training_material.batch(module, seed=step)
            phase(drawn, memory, config.rate_at(step, step / count))
    return module


def test_a_weight_of_zero_leaves_a_term_out():
    module = san_material.training_module(adversarial=0.0, cycle=0.0, ends=0.0, positions=0.0)
    losses = terms(module, training_material.batch(module))
    assert set(losses) == {"generator"}
    assert set(losses["generator"]) == {"edges", "root"}


def test_structures_of_other_chains_learn_together():
    """People and dogs: a tail, which people do not have, comes out of nothing."""
    module = san_material.training_module(LEGS, structures="all")
    losses = terms(module, training_material.batch(module))
    assert all(each.isfinite() for phase in losses.values() for each in phase.values())
    dog = module._structures["dog_four_legged"]
    assert set(dog.layout.names) - set(module._structures["plain"].layout.names) == {"tail"}


# ------------------------------------------------------------------------------------------- losses
def test_end_effectors_that_rest_count_more():
    """One of two rests in the answer; both are off by 0.001 heights a frame, along one axis."""
    source, answer = torch.zeros(1, 5, 2, 3), torch.zeros(1, 5, 2, 3)
    time = torch.arange(5.0)
    source[:, :, 0, 0] = 0.001 * time
    source[:, :, 1, 0], answer[:, :, 1, 0] = 0.003 * time, 0.002 * time
    assert end_effectors(source, answer).item() == pytest.approx(101 * (10 * 0.001) ** 2 / 3, rel=1e-4)
    moving = answer.clone()
    moving[:, :, 0, 0] = 0.002 * time
    assert end_effectors(source, moving).item() == pytest.approx((10 * 0.001) ** 2 / 3, rel=1e-4)


def test_heights_learn_and_keep_their_mean():
    heights = Heights(3)
    assert torch.equal(heights(torch.tensor([0, 2])), torch.ones(2, 1, 1, 1))
    heights.growth.data = torch.tensor([0.3, -0.1, 0.7])
    every = heights(torch.arange(3)).flatten()
    assert every.log().mean().item() == pytest.approx(0.0, abs=1e-6)
    assert (every[2] / every[0]).item() == pytest.approx(torch.tensor(0.4).exp().item())
    module = san_material.training_module(heights="learnt")
    before = terms(module, training_material.batch(module))["generator"]["ends"].item()
    assert before == pytest.approx(
        terms(san_material.training_module(), training_material.batch(module))["generator"]["ends"].item()
    )
    steps(module, 5)
    assert bool((module.modules["heights"].growth != 0).any())


# ------------------------------------------------------------------------------------------ refusals
def test_windows_too_short_for_a_patch_are_refused():
    module = san_material.training_module()
    data = module._windows._material
    for window in (28, 34):
        with pytest.raises(NotSupported, match="multiple of 4 and 32 or more"):
            San().training_module(data, TrainingConfig(1, 4, window, 1e-3))


def test_odd_joints_are_refused():
    odd = san_material.pan_material.without(BODIES["one"], "LeftHand", structure="plain")
    cast = {name: BODIES[name] for name in ("one", "tall")}
    data = training_material.training_data(San(), cast, (30, 40))
    data.characters["tall"] = odd
    with pytest.raises(NotSupported, match="give one of them another structure"):
        San().training_module(data, TrainingConfig(1, 4, 32, 1e-3))


def test_bodies_that_are_not_asked_for_are_not_trained_on():
    assert "four legs" in San().unfit(BODIES["rex"])
    assert not San(structures="all").unfit(BODIES["rex"])
    assert "not of dog" in San(structures="dog").unfit(BODIES["one"])
    with pytest.raises(BenchError, match="nothing to leak"):
        San(target_stats="own")
    with pytest.raises(BenchError, match="finite"):
        San(cycle=float("inf"))


# ------------------------------------------------------------------------------------------- weights
