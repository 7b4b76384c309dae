"""nkn as a method: what it learns from, what it answers, and that chunks and company change nothing."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from method_bodies import apart, body, carried, dance, without
from nkn_toys import CAST, structured, training_module
from training_material import batch

from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.nkn import plugin
from retarget_bench.training.layers.kinematic.features import answer
from retarget_bench.training.layers.kinematic.retargeter import Cases

SMALL = {"hidden": 16, "facing": 3.0, "drift": 0.0, "lengths": "world"}


@pytest.fixture(scope="module")
def method():
    """One with weights that make it move."""
    module = training_module(plugin(**SMALL))
    for each in module.modules["generator"].parameters():
        each.data += 0.1 * torch.randn_like(each)
    return module.method()


# ------------------------------------------------------------------------------------------- learning
def test_terms_of_the_ablations():
    every = {"same_places", "same_moves", "twist", "smooth"}
    cycle = every | {"cycle_places", "cycle_moves"}
    for losses, expected, phases in (
        ("autoencoder", every, 1),
        ("cycle", cycle, 1),
        ("adversarial", cycle | {"adversarial"}, 2),
    ):
        module = training_module(plugin(losses=losses, **SMALL))
        now = batch(module)
        assert set(module.losses("generator", now, {})) == expected
        assert len(module.phases) == phases
        assert ("real" in now["groups"][0]) == (phases == 2)
        assert bool(now["groups"][0]["same"].all()) == (losses == "autoencoder")
    assert "drift" in training_module(plugin(**{**SMALL, "drift": 0.1})).losses("generator", now, {})


def test_only_rows_of_the_same_body_are_compared_with_their_source():
    other_bodies = training_module(plugin(same=0.0, **SMALL))
    terms = other_bodies.losses("generator", batch(other_bodies), {})
    assert terms["same_places"].item() == terms["same_moves"].item() == 0.0
    same_bodies = training_module(plugin(same=1.0, **SMALL))
    memory: dict = {}
    assert same_bodies.losses("generator", batch(same_bodies), memory)["same_places"].item() > 0.0
    assert not memory["fakes"]
    assert same_bodies.losses("discriminator", batch(same_bodies), memory) == {}


def test_presets_are_the_papers_and_smaller_ones():
    paper = plugin.presets["paper"]
    assert (paper.steps, paper.batch, paper.window, paper.rate) == (50_000, 16, 60, 1e-4)
    assert set(plugin.presets) == {"paper", "default", "quick"}


# ---------------------------------------------------------------------------------------- retargeting
@pytest.mark.parametrize("path", ["integrated", "relative"])
def test_chunks_of_any_length_are_the_whole(method, path):
    source, target = dance(CAST["one"], 60), CAST["long"]
    method = plugin(**SMALL, path=path).using(method.tensors)
    sight, complete = method.see(source), carried(method, source, target)
    lead = sight.hips * target.measures.hip_height / source.character.measures.hip_height
    for sizes in ([1] * 60, [7, 1, 52], [59, 1]):
        stream = method.stream(Cases([source.character], [target]))
        parts, at = [], 0
        for size in sizes:
            part = slice(at, at + size)
            parts.append(stream.advance(*(each[part, None] for each in (sight.poses, sight.turn, lead))))
            at += size
        turns, turn, hips = (np.concatenate(each)[:, 0] for each in zip(*parts, strict=True))
        again = answer(method.body(target), turns, turn, hips, 60, 30.0)
        assert apart(again, complete) < 1e-6


def test_a_stream_keeps_no_more_of_a_long_clip_than_of_a_frame(method):
    sight, sizes = method.see(dance(CAST["one"], 60)), []
    for frames in (1, 60):
        stream = method.stream(Cases([CAST["one"]], [CAST["long"]]))
        stream.advance(*(each[:frames, None] for each in (sight.poses, sight.turn, sight.hips)))
        sizes.append(sum(each.untyped_storage().nbytes() for each in stream.held()))
    assert sizes[0] == sizes[1] == 4 * (4 * SMALL["hidden"] + 70 + 1)


def test_the_answer_begins_at_the_scaled_place_and_depends_on_the_source(method):
    target = CAST["small"]
    answers = [carried(method, dance(CAST["one"], seed=seed), target) for seed in (0, 1)]
    np.testing.assert_allclose(answers[0].root[0], 0.6 * dance(CAST["one"]).root[0], atol=1e-6)
    assert apart(*answers) > 1e-3


def test_yaw_of_the_source_is_kept_if_asked(method):
    source = dance(CAST["one"])
    tensors = method.tensors
    own = plugin(**SMALL, yaw="source").using(tensors)
    sight = own.see(source)
    stream = own.stream(Cases([source.character], [CAST["long"]]))
    _, turn, _ = stream.advance(*(each[:, None] for each in (sight.poses, sight.turn, sight.hips)))
    np.testing.assert_array_equal(turn[:, 0], sight.turn)
    assert apart(carried(own, source, CAST["long"]), carried(method, source, CAST["long"])) > 1e-3


def test_clean_up_takes_signs_from_the_source(method):
    source = dance(CAST["one"])
    cleaned = plugin(**SMALL, clean=True, yaw="source", path="integrated")
    clean = carried(cleaned.using(method.tensors), source, CAST["long"])
    sight = method.see(source)
    rises = np.diff(clean.root[:, 1])
    expected = sight.poses[1:, 67]
    assert (np.sign(rises[np.abs(rises) > 1e-9]) == np.sign(expected[np.abs(rises) > 1e-9])).all()
    assert not rises[np.abs(expected) <= 0.01].any()


# -------------------------------------------------------------------------------------------- refusals
def test_bodies_that_are_not_like_the_22_joints_are_refused_with_a_reason(method):
    armless = without(CAST["one"], "LeftHand")
    assert "left_hand" in method.supports(armless, CAST["one"])
    with pytest.raises(NotSupported, match="left_hand"):
        carried(method, dance(armless), CAST["one"])
    assert method.supports(CAST["one"], CAST["small"]) is None
    assert not method.unfit(body("bendy", spines=4))


def test_shipped_weights_of_other_parameters_are_refused():
    with pytest.raises(BenchError, match=r"trained as nkn.*hidden=512"):
        plugin(hidden=3).supports(CAST["one"], CAST["one"])


def test_a_learned_method_of_bodies_of_any_structure():
    """Structures do not matter to nkn, the 22 joints do."""
    mixed = {"one": CAST["one"], "other": structured(body(spines=4), "other", "more spine")}
    module = training_module(plugin(**SMALL), cast=mixed)
    assert list(module.modules["generator"]) == ["body22"]
