"""SAN while it is trained, and its answers."""

from __future__ import annotations

import numpy as np
import pytest
import san_material
import torch
import training_material
from method_bodies import apart, dance
from san_material import BODIES, trained

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.san import San
from retarget_bench.methods.san.losses import Heights
from retarget_bench.motion.character import Character
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


# ------------------------------------------------------------------------------------------- losses


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


# -------------------------------------------------------------------------------------------------- answers
def answer(source: str, target: str, frames: int = 40, **parameters):
    motion = dance(BODIES[source], frames)
    return trained(**parameters).retarget(motion, BODIES[target], context=Context())


def test_a_body_of_a_known_structure_need_not_have_been_trained_on():
    stranger = Character.of("stranger", BODIES["tall"].skeleton, structure="plain")
    motion = dance(BODIES["legs"], 32)
    assert trained().supports(motion.character, stranger) is None
    assert trained().retarget(motion, stranger, context=Context()).character is stranger


def test_other_structures_are_refused_in_a_sentence():
    method = trained()
    dog = BODIES["rex"]
    assert method.supports(BODIES["one"], dog) == (
        "rex is of structure dog, and these weights know plain, short_spine"
    )
    odd = Character.of("odd", BODIES["legs"].skeleton, structure="plain")
    assert "other joints than the plain" in method.supports(odd, BODIES["one"])
    with pytest.raises(NotSupported, match="these weights know"):
        method.retarget(dance(BODIES["one"], 20), dog, context=Context())


def test_people_and_dogs_exchange_motions():
    names = san_material.LEGS
    method = trained(names, structures="all")
    for source, target in (("one", "rex"), ("pup", "tall")):
        answer = method.retarget(dance(BODIES[source], 24), BODIES[target], context=Context())
        assert np.isfinite(answer.positions).all()


def shown(name):
    """The motions of a body that methods of ``san_material`` are trained on."""
    return tuple(dance(BODIES[name], frames, seed) for seed, frames in enumerate((30, 40)))


def test_statistics_of_a_target_come_from_training_or_from_its_references():
    own = San("released", target_stats="own").using(trained(variant="released").tensors)
    assert own.card.needs == ("target_motions",)
    motion = dance(BODIES["one"], 40)
    with pytest.raises(NotSupported, match="no motion of legs"):
        own.retarget(motion, BODIES["legs"], context=Context())
    leaked = own.retarget(motion, BODIES["legs"], context=Context(target_motions=shown("legs")))
    honest = answer("one", "legs", variant="released")
    assert apart(leaked, honest) < 1e-3  # trained on these very motions
    other = own.retarget(motion, BODIES["legs"], context=Context(target_motions=shown("stout")))
    assert apart(other, honest) > 1e-3


def test_ends_of_chains_are_copied_or_rest():
    still = answer("one", "tall", tips="rest")
    hand = BODIES["tall"].skeleton.index("LeftHand")
    assert np.ptp(answer("one", "tall").rotations[:, hand], axis=0).max() > 1e-2
    assert np.ptp(still.rotations[:, hand], axis=0).max() < 1e-6
