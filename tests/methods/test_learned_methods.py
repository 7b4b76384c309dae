"""What all learned methods have in common: drawing, learning, weights, and answers of any shape."""

from __future__ import annotations

import re
from copy import deepcopy
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pan_material
import pytest
import torch
from learned_methods import LEARNED, Learned
from method_bodies import body, dance, elsewhere, without
from scipy.spatial.transform import Rotation
from torch.utils._pytree import tree_leaves
from training_material import batch, training_data

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import registry
from retarget_bench.training import weights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.layers.adversarial import NknUpdateRule
from retarget_bench.training.phases import NORM, OptimiserPhase, optimiser_phases
from retarget_bench.training.record import Record

CPU = torch.device("cpu")
POSITIONS = ("nkn", "nkn_cross", "pmnet", "pmnet_cross", "smrm", "humot")
"""Methods for which a source's joint positions are enough."""
BATCHES = ("pan", "pan[parts=three]", "san", *POSITIONS)
"""Methods that answer batches."""
ANSWERING = {
    "pan": {"target_stats", "tips"},
    "san": {"target_stats", "tips"},
    "nkn": {"clean", "path", "yaw"},
    "nkn_cross": {"clean", "path", "yaw"},
    "pmnet": {"clean", "path", "yaw"},
    "pmnet_cross": {"clean", "path", "yaw"},
    "smrm": {"noise", "path", "variant"},
    "r2et": {"size"},
    "humot": {"root_rule", "windows"},
    "same": {"path"},
    "skr": {"points", "views"},
    "skin": {"skr"},
    "npt": set(),
    "paired": {"root_rule"},
}
"""Parameters that weights do not depend on."""
PIECES = {
    "pan": "training.layers.skeletal.inference.PIECE",
    "san": "training.layers.skeletal.inference.PIECE",
    "nkn": "methods.nkn.inference.CHUNK",
    "same": "methods.same.inference.CHUNK",
    "paired": "methods.paired.inference.CHUNK",
}
"""How many frames of a clip go through the networks at once."""
PATHS = {
    **dict.fromkeys(("nkn", "nkn_cross", "pmnet", "pmnet_cross", "smrm", "same"), "integrated"),
    "pan[parts=three]": "decoded",
}
"""Whose paths may follow the source's, and the name of their paths that do not."""
of_each = pytest.mark.parametrize("learned", LEARNED.values(), ids=list(LEARNED))
PLAIN = {name: each for name, each in LEARNED.items() if "[" not in name or "parts" in name}
of_plain = pytest.mark.parametrize("learned", PLAIN.values(), ids=list(PLAIN))
"""Without the variants, whose networks are made and asked in the same way."""
ODD = [
    ("pan", {"dropout": 1.0}, "dropout of pan is a share below 1"),
    ("pan", {"dropout": float("nan")}, "dropout of pan is a share below 1"),
    ("pan", {"kinematic": float("inf")}, "finite"),
    ("pan", {"facing": float("nan")}, "finite"),
    ("pan", {"target_stats": "own"}, "needs statistics=character"),
    ("pan", {"velocity": 1.0, "root": "position"}, "root=position lacks that"),
    ("pan", {"parts": "three", "root": "position"}, "root=position lacks that"),
    ("san", {"target_stats": "own"}, "nothing to leak"),
    ("san", {"cycle": float("inf")}, "finite"),
    ("nkn", {"hidden": 0}, "hidden is at least 1, same between 0 and 1"),
    ("nkn", {"same": 1.5}, "hidden is at least 1, same between 0 and 1"),
    ("nkn", {"facing": -1.0}, "hidden is at least 1, same between 0 and 1"),
    ("nkn", {"drift": -0.1}, "hidden is at least 1, same between 0 and 1"),
    ("pmnet", {"hidden": 0}, "hidden is at least 1, same between 0 and 1"),
    ("pmnet", {"same": 1.5}, "hidden is at least 1, same between 0 and 1"),
    ("pmnet", {"facing": -1.0}, "hidden is at least 1, same between 0 and 1"),
    ("smrm", {"context": 1}, "smrm"),
    ("smrm", {"hidden": 0}, "smrm"),
    ("smrm", {"noise": -0.1}, "noise"),
    ("smrm", {"same": 1.5}, "smrm"),
    ("smrm", {"smooth": -1.0}, "smrm"),
    ("r2et", {"facing": -1.0}, "facing of r2et is not negative, and dropout a share"),
    ("r2et", {"dropout": 1.0}, "facing of r2et is not negative, and dropout a share"),
    ("humot", {"consistency": -1.0}, "consistency is a weight"),
    ("humot", {"hop": 0}, "hop is a number of frames"),
    ("skr", {"network": "big"}, "skr"),
    ("skr", {"dropout": 1.0}, "skr"),
    ("skr", {"fewest": 9, "most": 8}, "skr"),
    ("skr", {"direction": "up"}, "skr"),
    ("skr", {"stretched": 1.5}, "skr"),
    ("skr", {"views": 3}, "skr"),
    ("skin", {"inputs": "angles"}, "skin"),
    ("skin", {"dropout": -1}, "skin"),
    ("skin", {"joints": "mine"}, "skin"),
    ("npt", {"width": 0}, "npt"),
    ("npt", {"points": 1}, "npt"),
    ("npt", {"pooling": "mean"}, "npt"),
]
"""Parameters that cannot be, and words of the sentence that says so."""


DOG, ARMLESS = pan_material.BODIES["rex"], without(body(), "LeftHand")
THING = Character.of(
    "thing", Skeleton(("Thing", "Other"), np.array([-1, 0]), np.eye(2, 3)), roles=(None, None)
)
UNFIT = [
    ("nkn", ARMLESS, "left_hand"),
    ("nkn", body(spines=4), ""),
    ("smrm", ARMLESS, "left_hand"),
    ("smrm", body(spines=5), ""),
    ("humot", DOG, "stands on four legs"),
    ("paired", DOG, "four legs"),
    ("paired", body(), ""),
    ("same", THING, "no joint of thing is known as hips"),
    ("same", DOG, ""),
    ("pan", DOG, r"pan\[parts=three\] is for bodies of two and of four"),
    ("pan[parts=three]", DOG, ""),
    ("san", DOG, "four legs"),
    ("san[structures=all]", DOG, ""),
    ("san[structures=dog]", body(), "not of dog"),
    ("skr", body(), "mesh"),
]
"""Bodies, and words of the sentence that says why a method does not train on them; none where it does."""


def phases_of(module: Any) -> list[OptimiserPhase]:
    return optimiser_phases(module, TrainingConfig(steps=1, batch=6, window=16, rate=1e-3), CPU)


def step(module: Any, phases: list[OptimiserPhase], seed: int) -> None:
    """A step as the training loop does it: its batch and its dropout are those of the seed."""
    torch.manual_seed(seed)
    rows, memory = batch(module, seed=seed), {}
    for phase in phases:
        phase(rows, memory, 1e-3)


def equal(one: Any, other: Any) -> bool:
    """Whether nested batches or tensors by name hold the same numbers."""
    leaves = [tree_leaves(dict(each)) for each in (one, other)]
    return len(leaves[0]) == len(leaves[1]) and all(map(np.array_equal, *leaves))


def answer(method: Any, source: Any, target: Any) -> Any:
    return method.retarget(source, target, context=Context(seed=3))


def places(answered: Any) -> np.ndarray:
    """The joints, or the vertices, of an answer."""
    return answered.vertices if hasattr(answered, "vertices") else answered.positions


# --------------------------------------------------------------------------------------------- training
@of_plain
def test_a_batch_depends_on_its_numbers_alone(learned: Learned) -> None:
    module = learned.module()
    one, same, other = (batch(module, seed=seed) for seed in (3, 3, 4))
    assert equal(one, same)
    assert not equal(one, other)


@of_each
def test_gradients_reach_every_parameter(learned: Learned) -> None:
    module, reached = learned.moved(), dict[str, bool]()
    for seed in range(learned.seeds):
        rows, memory = batch(module, seed=seed), dict[str, Any]()
        for phase in module.phases:
            module.modules.zero_grad(set_to_none=True)
            torch.stack(list(module.losses(phase.name, rows, memory).values())).sum().backward()
            for part in phase.modules:
                for name, each in module.modules[part].named_parameters():
                    moved = each.grad is not None and bool(each.grad.abs().max() > 0)
                    assert not moved or torch.isfinite(each.grad).all(), name
                    reached[f"{part}.{name}"] = reached.get(f"{part}.{name}", False) or moved
    missed = [name for name, there in reached.items() if not there]
    assert [name for name in missed if not any(part in name for part in learned.resting)] == []


@of_plain
def test_training_repeats_itself_and_depends_on_its_seed(learned: Learned) -> None:
    exports = []
    for first in (0, 0, 5):
        module = learned.module()
        phases = phases_of(module)
        for number in range(2):
            step(module, phases, first + number)
        exports.append(module.export())
    assert equal(exports[0], exports[1])
    assert not equal(exports[0], exports[2])


@of_plain
def test_interrupted_training_goes_on_as_if_it_had_not_been(learned: Learned) -> None:
    """What a checkpoint holds is all that a step depends on."""
    module = learned.module()
    phases = phases_of(module)
    for seed in range(2):
        step(module, phases, seed)
    again = learned.module()
    again.modules.load_state_dict(deepcopy(module.modules.state_dict()))
    later = phases_of(again)
    for phase, before in zip(later, phases, strict=True):
        phase.restore(deepcopy(before.state()))
    for each, its in ((module, phases), (again, later)):
        step(each, its, 2)
    assert equal(module.export(), again.export())


@pytest.mark.parametrize("name", ["nkn", "nkn_cross", "pmnet", "pmnet_cross", "smrm", "r2et"])
def test_a_discriminator_rests_while_nothing_fools_it(name: str) -> None:
    """By NKN's running score."""
    module = LEARNED[name].module()
    (rule,) = (each for each in module.modules.modules() if isinstance(each, NknUpdateRule))
    rows, memory = batch(module), dict[str, Any]()
    for score, learns in ((0.5, True), (0.2, False)):
        rule.running.fill_(score)
        generator, discriminator = module.phases
        module.losses(generator.name, rows, memory)
        assert bool(module.losses(discriminator.name, rows, memory)) == learns


@of_plain
def test_training_lowers_the_loss(learned: Learned) -> None:
    module = learned.module()
    (phase, *_), rows, losses = phases_of(module), batch(module), []
    for number in range(15):
        torch.manual_seed(number)
        terms = phase(rows, {}, learned.rate)
        losses.append(sum(float(each) for name, each in terms.items() if not name.endswith(NORM)))
    assert np.mean(losses[-3:]) < 0.95 * losses[0]


@pytest.mark.parametrize("name", [name for name in ANSWERING if name not in ("humot", "skr", "skin")])
def test_one_character_is_not_enough(name: str) -> None:
    learned, method = LEARNED[name], registry.load("methods", name)()
    body = learned.names[0][0]
    alone = training_data(method, {body: learned.body(body)}, (70,))
    with pytest.raises(NotSupported, match=r"two characters|by two bodies"):
        method.training_module(alone, TrainingConfig(steps=1, batch=4, window=32, rate=1e-3))


# ---------------------------------------------------------------------------------------------- weights
@of_plain
def test_weights_come_back_from_their_files(learned: Learned, tmp_path: Any) -> None:
    method = learned.method()
    card = Record(method=method.card.name, version=method.card.version, facts=method.facts())
    stored = weights.write(tmp_path, "weights", method.tensors, card, exact=list(method.tensors))
    again = type(method)(**{**method.facts(), **learned.said}, weights=str(tmp_path))
    assert again.facts() == method.facts()
    assert again.weights_hash == stored.hash
    source, target = learned.cases()[0]
    np.testing.assert_array_equal(*(places(answer(each, source, target)) for each in (method, again)))


@of_plain
def test_training_begins_with_given_weights_of_the_same_shapes_only(learned: Learned) -> None:
    tensors = learned.moved().export()
    module = learned.module()
    assert not equal(module.export(), tensors)
    module.load({name: each.clone() for name, each in tensors.items()})
    assert equal(module.export(), tensors)
    name = max(tensors, key=lambda each: tensors[each].numel())
    for odd in (
        {**tensors, name: tensors[name][..., :-1]},
        {key: tensors[key] for key in tensors if key != name},
    ):
        with pytest.raises(BenchError):
            module.load(odd)


@of_plain
def test_without_weights_it_says_what_makes_some(learned: Learned, monkeypatch: Any) -> None:
    method = learned.method()
    monkeypatch.setattr(type(method), "shipped", classmethod(lambda cls: {}))
    source, target = learned.cases()[0]
    untrained = type(method)(**method.facts())
    assert f"bench train {method.card.name}" in untrained.supports(source.character, target)


@pytest.mark.parametrize("name", ANSWERING)
def test_weights_know_all_parameters_that_they_depend_on(name: str) -> None:
    method = registry.load("methods", name)()
    assert set(method.facts()) | ANSWERING[name] | {"weights"} == set(method.card.parameters)


@pytest.mark.parametrize(("name", "parameters", "words"), ODD)
def test_parameters_that_cannot_be_are_refused(name: str, parameters: Any, words: str) -> None:
    with pytest.raises(BenchError, match=words):
        registry.load("methods", name)(**parameters)


@pytest.mark.parametrize(("spec", "character", "words"), UNFIT)
def test_bodies_that_are_unfit_are_told_why(spec: str, character: Character, words: str) -> None:
    assert re.search(words, why := registry.create("methods", spec).unfit(character))
    assert bool(why) == bool(words)


# ---------------------------------------------------------------------------------------------- answers
@of_each
def test_any_length_and_rate(learned: Learned) -> None:
    method = learned.method()
    for (name, _, other), (frames, fps) in product(learned.names[:2], ((1, 30.0), (2, 60.0), (31, 24.0))):
        source = learned.source(replace(dance(learned.body(name), frames), fps=fps))
        target = learned.body(other)
        assert method.supports(source.character, target) is None
        result = answer(method, source, target)
        assert (result.frames, result.fps) == (frames, fps)
        assert result.character is target
        assert np.isfinite(places(result)).all()
        if hasattr(result, "rotations"):
            np.testing.assert_allclose(np.linalg.norm(result.rotations, axis=-1), 1.0, atol=1e-6)


@pytest.mark.parametrize(("name", "constant"), PIECES.items())
def test_long_clips_go_through_in_pieces(name: str, constant: str, monkeypatch: Any) -> None:
    learned = LEARNED[name]
    method, target = learned.method(), learned.body(learned.names[0][2])
    source = learned.source(dance(learned.body(learned.names[0][0]), 300))
    at_once = places(answer(method, source, target))
    monkeypatch.setattr(f"retarget_bench.{constant}", 64)
    assert np.abs(places(answer(method, source, target)) - at_once).max() < 1e-5 * target.height


@pytest.mark.parametrize("name", BATCHES)
def test_a_batch_in_any_order_and_on_any_threads_gives_what_its_rows_give_alone(name: str) -> None:
    method, cases = LEARNED[name].method(), LEARNED[name].cases()
    assert method.retarget_batch([], [], contexts=[]) == []
    threads = torch.get_num_threads()
    try:
        torch.set_num_threads(1)
        alone = [answer(method, *case) for case in cases]
        torch.set_num_threads(2)
        for order in (list(range(len(cases))), list(range(len(cases)))[::-1]):
            sources, targets = zip(*(cases[number] for number in order), strict=True)
            answers = method.retarget_batch(sources, targets, contexts=[Context(seed=3)] * len(cases))
            for number, each in zip(order, answers, strict=True):
                one = alone[number]
                assert (each.frames, each.fps, each.character) == (one.frames, one.fps, cases[number][1])
                assert np.abs(places(each) - places(one)).max() < 1e-5 * one.character.height
    finally:
        torch.set_num_threads(threads)


@of_plain
def test_answers_depend_on_source_and_target(learned: Learned) -> None:
    method, (source, target) = learned.method(), learned.cases()[0]
    other = learned.source(dance(learned.body(learned.names[0][0]), source.frames, 17))
    one, two = (places(answer(method, each, target)) for each in (source, other))
    assert np.abs(one - two).max() > 1e-3 * target.height


@pytest.mark.parametrize("name", [name for name in PLAIN if name not in ("skr", "npt")])
def test_answers_turn_and_move_with_their_source(name: str) -> None:
    """But for methods that draw points, which have others then."""
    learned = LEARNED[name]
    method, target = learned.method(), learned.body(learned.names[0][2])
    source = dance(learned.body(learned.names[0][0]), 30)
    answers = [
        places(answer(method, learned.source(each), target))
        for each in (source, elsewhere(source, 130.0), elsewhere(source, 0.0, (3.0, 0.0, -5.0)))
    ]
    turned = Rotation.from_euler("Y", 130, degrees=True).apply(answers[0].reshape(-1, 3))
    np.testing.assert_allclose(answers[1].reshape(-1, 3), turned, atol=2e-5 * target.height)
    step = answers[2] - answers[0]
    assert np.abs(step - step[0, 0]).max() < 2e-6 * target.height
    np.testing.assert_allclose(step[0, 0] / step[0, 0, 0], [1.0, 0.0, -5.0 / 3.0], atol=1e-6)


@pytest.mark.parametrize(("name", "summed"), PATHS.items())
def test_errors_of_relative_paths_fade_and_those_of_summed_ones_add_up(name: str, summed: str) -> None:
    """Twenty seconds by networks that learnt nothing, whose moves are wrong from beginning to end."""
    learned = LEARNED[name]
    body, target = learned.body(learned.names[0][0]), learned.body(learned.names[0][2])
    source, plain = dance(body, 600), learned.method()
    ratio, away = target.measures.hip_height / body.measures.hip_height, {}
    for path in ("relative", summed):
        method = type(plain)(**{**plain.facts(), "path": path}).using(plain.tensors)
        off = (answer(method, source, target).root - ratio * source.root)[:, [0, 2]]
        away[path] = np.linalg.norm(off, axis=-1)
        assert away[path][0] < 1e-6
    assert away["relative"][300:].max() < 1.2 * away["relative"][:100].max()
    assert away[summed][300:].max() > 1.2 * away[summed][:100].max()
    assert away[summed].max() > 3.0 * away["relative"].max()


@pytest.mark.parametrize("name", [name for name in PLAIN if name != "npt"])
def test_joint_positions_are_answered_like_their_motion_or_refused(name: str) -> None:
    learned = LEARNED[name]
    method = learned.method()
    source = dance(learned.body(learned.names[0][0]), 3)
    target = learned.body(learned.names[0][2])
    positions = source.character.positions(source.positions, source.fps)
    assert ("positions" in method.card.accepts) == (name in POSITIONS)
    if name in POSITIONS:
        one, other = (places(answer(method, each, target)) for each in (source, positions))
        assert np.abs(one - other).max() < 1e-5 * target.height
    else:
        with pytest.raises(NotSupported, match=r"rotations|positions|points"):
            answer(method, positions, target)
