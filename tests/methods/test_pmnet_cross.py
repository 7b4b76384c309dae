"""pmnet_cross: structures with networks of their own around features of one size."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from nkn_toys import STRUCTURES as CAST
from nkn_toys import training_module

from retarget_bench.methods.pmnet import plugin as Pmnet
from retarget_bench.methods.pmnet_cross import plugin
from retarget_bench.training.phases import to_device

SMALL = {"hidden": 12, "facing": 3.0}


@pytest.fixture(scope="module")
def module():
    built = training_module(plugin(**SMALL), cast=CAST)
    for each in built.modules["generator"].parameters():
        each.data += 0.1 * torch.randn_like(each)
    return built


def group_of(module, crossing: bool):
    drawn = (module.draw(np.random.default_rng(seed), 4)["groups"] for seed in range(50))
    chosen = next(
        group
        for groups in drawn
        for group in groups
        if (group["structures"][0] != group["structures"][1]) == crossing
    )
    return to_device(chosen, torch.device("cpu"))


def test_every_structure_has_networks_of_its_own_size(module):
    generators = module.modules["generator"]
    assert list(generators) == ["five_spine", "three"]
    for name, joints in (("five_spine", 24), ("three", 22)):
        assert generators[name].encoder[0].in_features == 3 * joints
        assert generators[name].turns.out_features == 4 * joints
        assert generators[name].turns.in_features == 12
    assert list(module.modules["discriminator"]) == ["five_spine", "three"]


def test_with_one_structure_it_is_pmnet():
    cast = {name: CAST[name] for name in ("one", "long")}
    sizes = [
        sum(each.numel() for each in training_module(method, cast=cast).modules["generator"].parameters())
        for method in (plugin(), Pmnet())
    ]
    assert sizes == [918_244, 918_244]


def test_rows_of_two_structures_are_held_to_features_and_ends(module):
    crossing, within = ({"groups": [group_of(module, kind)]} for kind in (True, False))
    terms = {name: each.item() for name, each in module.losses("generator", crossing, {}).items()}
    assert terms["same_places"] == terms["same_moves"] == 0.0
    assert min(terms[name] for name in ("places", "features", "adversarial", "ends", "ends_moves")) > 0.0
    other = module.losses("generator", within, {})
    assert list(other) == list(terms)
    assert other["ends"].item() == other["ends_moves"].item() == 0.0
    assert training_module(plugin(**SMALL, ends=0.0), cast=CAST).ends is None


def test_gradients_of_a_crossing_row_reach_the_heads_of_the_target_alone(module):
    group = group_of(module, True)
    source, target = (module.modules["generator"][module._names[k]] for k in group["structures"])
    module.losses("generator", {"groups": [group]}, {})["features"].backward()
    assert float(target.mapping.weight.grad.abs().max()) > 0.0
    assert source.mapping.weight.grad is None
    assert float(source.encoder[0].weight.grad.abs().max()) > 0.0
    module.modules.zero_grad(set_to_none=True)


def test_sources_are_real_to_the_discriminator_of_their_own_structure(module):
    group, memory = group_of(module, True), {}
    module.losses("generator", {"groups": [group]}, memory)
    module.losses("discriminator", {"groups": [group]}, memory)["cross_entropy"].backward()
    answered = module._names[group["structures"][1]]
    for name, network in module.modules["discriminator"].items():
        learned = network.last.weight.grad is not None
        assert learned == (name == answered)  # the other has judged no answer, so its score stays
    module.modules.zero_grad(set_to_none=True)
