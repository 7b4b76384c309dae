"""SAN: training, answers, skeletons, and networks beside the plain masked form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import san_material
import torch
import training_material
from method_bodies import apart, dance
from san_material import BODIES, trained
from san_reference import S23, S28, PlainDiscriminator, make_plain

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.methods.san import San
from retarget_bench.methods.san.losses import Heights
from retarget_bench.methods.san.network import Design, Discriminator
from retarget_bench.methods.san.skeleton import Edges, layout_of
from retarget_bench.methods.san.structure import Structure, share_initialisation
from retarget_bench.motion.character import Character
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.joint_datasets import dataset
from retarget_bench.training.layers.skeletal.layout import Layout
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
    own = San(variant="released", target_stats="own").using(trained(variant="released").tensors)
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


# ----------------------------------------------------------------------------------- skeletons and networks
DESIGNS = {"released": Design("released", padded=True), "fixed": Design()}
designs = pytest.mark.parametrize("design", DESIGNS.values(), ids=DESIGNS)
layouts = pytest.mark.parametrize("layout", [S23, S28], ids=["S23", "S28"])

FORK = (-1, 0, 1, 2, 2, 4)
"""A trunk of two edges (0, 1), a short branch (2) and one of two edges (3, 4); slot 5 is the root's."""


# ---------------------------------------------------------------------------------------- skeletons
def test_neighbours_of_a_small_tree():
    edges = Edges.of(FORK)
    assert edges.neighbours(1, "fixed") == (
        (0, 1, 5),
        (0, 1, 2, 3),
        (1, 2, 3),
        (1, 2, 3, 4),
        (3, 4),
        (0, 5),
    )
    assert edges.neighbours(2, "fixed") == (
        (0, 1, 2, 3, 5),
        (0, 1, 2, 3, 4, 5),
        (0, 1, 2, 3, 4),
        (0, 1, 2, 3, 4),
        (1, 2, 3, 4),
        (0, 1, 5),
    )


@pytest.mark.parametrize(
    "parents", [(-1, 0), (-1, 0, 0, 0), (-1, 0, 1, 1, 0), FORK, S23.parents, S28.parents]
)
def test_chains_share_out_the_edges_of_any_tree(parents):
    edges = Edges.of(parents)
    assert sorted(sum(edges.chains, ())) == list(range(len(edges.pairs)))
    forks = {joint for joint in range(len(parents)) if joint == 0 or parents.count(joint) != 1}
    for chain in edges.chains:
        assert edges.pairs[chain[0]][0] in forks
        assert edges.pairs[chain[-1]][1] in forks
        assert not {edges.pairs[edge][1] for edge in chain[:-1]} & forks


def test_chains_are_named_after_the_parts_that_the_body_ends_in():
    parents = (-1, 0, 1, 0, 3, 3, 3, 0, 7, 7)
    roles = (
        "hips",
        "right_up_leg",
        "right_foot",
        "spine_1",
        "left_arm",
        None,
        "head",
        None,
        "tail_1",
        "left_foot",
    )
    assert layout_of(parents, roles).names == (
        "right_leg",
        "head+left_arm+trunk",
        "left_arm",
        "trunk",
        "head",
        "left_leg+tail",
        "tail",
        "left_leg",
    )
    assert layout_of((-1, 0, 1, 1), (None, "left_leg", None, None)).names == (
        "left_leg",
        "left_leg_2",
        "left_leg_3",
    )
    assert layout_of((-1, 0, 0), (None,) * 3).names == ("end 1", "end 2")


def test_the_authors_trees_begin_where_the_legs_do():
    """So that a body with a pelvis below its hips has the chains of others; ours keeps the hips."""
    cast = dataset(Spec.parse("puppets")).characters()
    names = {
        variant: [San(variant=variant).body(cast[each]).layout.names for each in ("petra", "ada", "mina")]
        for variant in ("released", "own")
    }
    assert len({*names["released"]}) == 1
    pelvis, *others = names["own"]
    assert {*others} == {names["released"][0]}
    assert {*pelvis} - {*others[0]} == {"left_leg+right_leg"}


# ------------------------------------------------------------------------------------------- counts
COUNTS = {"S23": (1_101_708, 20_172, 309_138), "S28": (1_933_728, 35_292, 545_148)}
LIVE = {"S23": (465_264, 8_670, 132_072), "S28": (614_028, 11_442, 174_654)}
"""Parameters of auto-encoder, static encoder and discriminator: with those outside masks, and without."""


def parameters(*modules: torch.nn.Module) -> int:
    return sum(each.numel() for module in modules for each in module.parameters())


@pytest.mark.parametrize(("name", "layout"), [("S23", S23), ("S28", S28)])
def test_parameters_are_those_of_record(name, layout):
    structure = Structure(layout, DESIGNS["released"])
    judge = Discriminator(structure.levels)
    assert LIVE[name] == (
        parameters(structure.encoder, structure.decoder),
        parameters(structure.skeleton),
        parameters(judge),
    )
    plain = make_plain(structure)
    dense = parameters(PlainDiscriminator(judge, structure.levels))
    assert COUNTS[name] == (parameters(plain.encoder, plain.decoder), parameters(plain.skeleton), dense)


# ----------------------------------------------------------------------------------- the plain form
def networks(layout: Layout, design: Design) -> Structure:
    torch.manual_seed(3)
    return Structure(layout, design)


def inputs(layout: Layout, frames: int = 24) -> tuple[torch.Tensor, torch.Tensor]:
    torch.manual_seed(4)
    return torch.randn(3, frames, layout.edges + 1, 4), torch.randn(3, layout.edges + 1, 3)


@designs
@layouts
def test_answers_and_gradients_are_those_of_masks_and_products(layout, design):
    lean, plain = networks(layout, design), make_plain(networks(layout, design))
    motion, bones = inputs(layout)
    answers = []
    for structure in (lean, plain):
        code = structure.encoder(motion, structure.codes(bones)[:2])
        answer = structure.answer(code, bones)
        (answer.square().sum() + code.sum()).backward()
        answers.append((code.detach(), answer.detach()))
    for own, reference in zip(*answers, strict=True):
        torch.testing.assert_close(own, reference, rtol=1e-5, atol=1e-5)
    for side in ("encoder", "decoder"):
        for number in range(2):
            for kind in ("motion", "body"):
                own = lean.get_submodule(f"{side}.layers.{number}.{kind}")
                reference = plain.get_submodule(f"{side}.{kind}.{number}")
                for name in ("weight", "bias"):
                    one, other = (getattr(each, name).grad.norm() for each in (own, reference))
                    torch.testing.assert_close(one, other, rtol=1e-5, atol=0.0)


@designs
def test_discriminators_are_those_of_masks_and_products(design):
    torch.manual_seed(5)
    levels = design.levels(S28)
    lean = Discriminator(levels)
    plain = PlainDiscriminator(lean, levels)
    values = torch.randn(4, 40, 28, 3)
    for training in (True, False):
        torch.testing.assert_close(
            lean.train(training)(values), plain.train(training)(values), rtol=1e-5, atol=1e-6
        )
    torch.testing.assert_close(lean.norm.running_mean, plain.norm.running_mean)


@designs
@pytest.mark.parametrize("frames", [16, 124, 128, 132, 256, 260])
def test_frozen_weights_answer_alike_and_follow_to_double(design, frames):
    """Also where doubling is part of the convolution: from 256 frames on in both layers."""
    structure = networks(S23, design)
    values, bones = inputs(S23, frames)
    structure, values, bones = structure.double(), values.double(), bones.double()
    before = structure.answer(structure.encoder(values, structure.codes(bones)), bones)
    structure.freeze()
    after = structure.answer(structure.encoder(values, structure.codes(bones)), bones)
    torch.testing.assert_close(after, before, rtol=1e-9, atol=1e-12)
    assert after.dtype == torch.float64


def test_structures_begin_with_codes_alike():
    """Shared initial weights bring what two structures make of the same chain closer together."""

    def distance(share: bool) -> float:
        torch.manual_seed(7)
        with_roles = [replace(layout, names=S28.names) for layout in (S23, S28)]
        pair = [Structure(each, DESIGNS["fixed"]) for each in with_roles]
        if share:
            share_initialisation(pair)
        one, other = (each.encoder.layers[1].motion.weight for each in pair)
        codes = []
        for each in pair:
            still = torch.ones(1, 16, each.layout.edges + 1, 4)
            codes.append(each.encoder(still, each.codes(torch.ones(1, each.layout.edges + 1, 3))))
        assert torch.equal(one[-1], other[-1]) is share
        return (codes[0] - codes[1]).abs().mean().item()

    assert distance(share=True) < 0.9 * distance(share=False)


def test_what_it_does_in_its_own_way_is_what_the_label_says():
    own, released = (San(variant=variant).settings.values() for variant in ("own", "released"))
    assert {key for key, value in own.items() if released[key] != value} == set(San().card.differs)
    assert not San(variant="released").card.differs
    assert San(variant="released", neighbours="fixed").settings.design == Design("fixed", padded=True)
