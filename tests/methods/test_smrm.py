"""What SMRM sees of a motion, against plain geometry, and its answers."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import method_bodies
import numpy as np
import pytest
import smrm_material
import torch
from method_bodies import apart, carried, dance

from retarget_bench.methods.smrm.features import Features, unfit
from retarget_bench.methods.smrm.inference import retargeted
from retarget_bench.motion import facing
from retarget_bench.motion.body22 import JOINTS
from retarget_bench.motion.structures import reduce

FORMS = [
    Features(*each)
    for each in product(("body", "none"), ("height", "displacement", "position"), ("removed", "kept"))
]


def danced(name: str = "one", frames: int = 25):
    return method_bodies.dance(smrm_material.BODIES[name], frames)


@pytest.mark.parametrize("features", FORMS, ids=str)
def test_what_is_seen_gives_the_motion_back(features):
    motion = danced()
    encoded, body = features.see(motion), features.body(motion.character)
    moves = features.moves(encoded["hips"], encoded["before"], encoded["turn"])
    for kind in ("integrated", "relative"):
        again = features.motion(body, encoded["rotations"], moves, encoded, motion.root, kind)
        np.testing.assert_allclose(again.positions, motion.positions, atol=1e-6)


@pytest.mark.parametrize("features", FORMS, ids=str)
def test_positions_are_those_of_the_22_joints_from_where_it_faces(features):
    motion = danced()
    encoded, joints = features.see(motion), list(reduce(motion.character, "body22").joints)
    unit = motion.character.measures.hip_height if features.normalisation == "body" else 1.0
    turn = facing.facing(motion.positions, motion.character) if features.yaw == "removed" else np.ones(25)
    expected = facing.seen(motion.positions[:, joints] - motion.positions[:, :1], turn[:, None]) / unit
    assert expected.shape == (25, JOINTS, 3)
    np.testing.assert_allclose(encoded["positions"], expected, atol=1e-9)


def test_a_larger_copy_looks_the_same_in_its_own_unit_alone():
    small, large = danced("one"), danced("tall")
    expected = large.character.measures.hip_height / small.character.measures.hip_height
    for normalisation, ratio in (("body", 1.0), ("none", expected)):
        features = Features(normalisation, "height", "removed")
        np.testing.assert_allclose(
            features.see(large)["positions"], ratio * features.see(small)["positions"], atol=1e-9
        )


@pytest.mark.parametrize("root", ["height", "displacement", "position"])
def test_velocity_is_the_change_of_place(root):
    """Seen from one direction all along, the three ways to say where the hips are move alike."""
    features, random = Features("none", root, "kept"), np.random.default_rng(0)
    hips = random.normal(size=(20, 3))
    turn = np.tile([1.0, 0.0], (20, 1))
    before = np.concatenate([hips[:1], hips[:-1]])
    moves = torch.from_numpy(features.moves(hips, before, turn))
    np.testing.assert_allclose(features.velocity(moves).numpy(), np.diff(hips, axis=0), atol=1e-12)
    path = features.path(moves, torch.from_numpy(turn)).numpy()
    np.testing.assert_allclose(np.diff(path, axis=0), np.diff(hips, axis=0), atol=1e-12)


def test_says_why_a_body_is_none_that_it_knows():
    assert unfit(method_bodies.body()) == ""
    assert unfit(method_bodies.body(spines=2)) == ""
    assert "left_hand" in unfit(method_bodies.without(method_bodies.body(), "LeftHand"))
    assert unfit(method_bodies.body(spines=5)) == ""


# -------------------------------------------------------------------------------------------------- answers
BODIES = smrm_material.BODIES


@pytest.fixture(scope="module")
def training_module():
    module = smrm_material.training_module()
    with torch.no_grad():  # answers that differ from frame to frame, as trained ones do
        module.generator.turns.weight.mul_(10.0)
    return module


@pytest.fixture(scope="module")
def method(training_module):
    return training_module.method()


@pytest.mark.parametrize("chunk", [1, 7, 64, 1000])
@pytest.mark.parametrize("path", ["integrated", "relative"])
@pytest.mark.parametrize("root", ["height", "displacement", "position"])
def test_chunks_of_any_size_give_what_the_whole_gives(chunk, root, path):
    module = smrm_material.training_module(root=root)
    source = dance(smrm_material.BODIES["one"], 90)
    at_once, parts = (
        retargeted(module.generator.eval(), module.features, [source], [BODIES["legs"]], size, path)[0]
        for size in (90, chunk)
    )
    assert apart(at_once, parts) < 1e-6


@pytest.mark.parametrize("fps", [25.0, 29.0, 50.0, 59.94, 90.0, 240.0, 1000.0])
def test_no_clip_stands_still_at_its_end(method, fps):
    source = dance(smrm_material.BODIES["one"], 170)
    positions = carried(method, replace(source, fps=fps), BODIES["tall"]).positions
    assert (np.abs(np.diff(positions[-40:], axis=0)).max(axis=(1, 2)) > 0).all()


@pytest.mark.parametrize("fps", [29.97, 30000 / 1001, 30.03])
def test_rounded_rates_are_thirty(method, fps):
    source = dance(smrm_material.BODIES["one"], 170)
    actual, plain = (carried(method, replace(source, fps=rate), BODIES["tall"]) for rate in (fps, 30.0))
    assert actual.fps == fps
    np.testing.assert_array_equal(actual.positions, plain.positions)


def test_training_goes_on_as_it_was(training_module):
    training_module.generator.train()
    carried(training_module.method(), dance(smrm_material.BODIES["one"], 10), BODIES["tall"])
    assert training_module.generator.training
    assert training_module.generator.encoder.training
