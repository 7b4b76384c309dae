"""What SMRM sees of a motion, against plain geometry."""

from __future__ import annotations

from itertools import product

import method_bodies
import numpy as np
import pytest
import smrm_material
import torch

from retarget_bench.methods.smrm.features import Features, unfit
from retarget_bench.motion import facing
from retarget_bench.motion.body22 import JOINTS
from retarget_bench.motion.root_rules import MEMORY
from retarget_bench.motion.structures import reduce

FORMS = [
    Features(*each)
    for each in product(("body", "none"), ("height", "displacement", "position"), ("removed", "kept"))
]


def dance(name: str = "one", frames: int = 25):
    return method_bodies.dance(smrm_material.BODIES[name], frames)


def turned_about(motion, degrees: float, shift: np.ndarray):
    """The same motion seen from elsewhere."""
    from retarget_bench.motion import rotation

    turn = np.exp(1j * np.radians(degrees))
    rotations = motion.rotations.copy()
    rotations[:, 0] = rotation.multiply(facing.rotation(np.array(turn)), rotations[:, 0])
    return motion.character.motion(
        rotations, facing.placed(motion.root, np.array(turn)) + shift, motion.fps
    )


@pytest.mark.parametrize("features", FORMS, ids=str)
def test_what_is_seen_gives_the_motion_back(features):
    motion = dance()
    encoded, body = features.see(motion), features.body(motion.character)
    moves = features.moves(encoded["hips"], encoded["before"], encoded["turn"])
    for kind in ("integrated", "relative"):
        again = features.motion(body, encoded["rotations"], moves, encoded, motion.root, kind)
        np.testing.assert_allclose(again.positions, motion.positions, atol=1e-6)


def test_a_constant_error_of_moves_does_not_grow_with_time():
    """A minute of a step too long by a hundredth of the hips' height in every frame."""
    features, motion = FORMS[0], dance(frames=1800)
    encoded, body = features.see(motion), features.body(motion.character)
    moves = features.moves(encoded["hips"], encoded["before"], encoded["turn"]) + np.array([0.0, 0.0, 0.01])
    turns = encoded["turn"][:, 0] + 1j * encoded["turn"][:, 1]
    off, total, summed = np.zeros((1800, 2)), np.zeros(2), np.zeros(2)
    for frame in range(1, 1800):
        step = 0.01 * body.unit * np.array([turns[frame].imag, turns[frame].real])
        summed, total = summed + step, np.exp(-1 / (30 * MEMORY)) * total + step
        off[frame] = total
    relative_error, plain = (
        features.motion(body, encoded["rotations"], moves, encoded, motion.root, kind).root - motion.root
        for kind in ("relative", "integrated")
    )
    np.testing.assert_allclose(relative_error[:, [0, 2]], off, atol=1e-6)
    np.testing.assert_allclose(plain[-1, [0, 2]], summed, atol=1e-6)
    assert np.abs(relative_error).max() < 0.01 * body.unit * (30 * MEMORY + 1)


@pytest.mark.parametrize("features", FORMS, ids=str)
def test_positions_are_those_of_the_22_joints_from_where_it_faces(features):
    motion = dance()
    encoded, joints = features.see(motion), list(reduce(motion.character, "body22").joints)
    unit = motion.character.measures.hip_height if features.normalisation == "body" else 1.0
    turn = facing.facing(motion.positions, motion.character) if features.yaw == "removed" else np.ones(25)
    expected = facing.seen(motion.positions[:, joints] - motion.positions[:, :1], turn[:, None]) / unit
    assert expected.shape == (25, JOINTS, 3)
    np.testing.assert_allclose(encoded["positions"], expected, atol=1e-9)


@pytest.mark.parametrize("root", ["height", "displacement", "position"])
def test_where_one_stands_and_looks_is_not_seen(root):
    features = Features("body", root, "removed")
    motion = dance()
    there = turned_about(motion, 77.0, np.array([3.0, 0.0, -2.0]))
    one, other = features.see(motion), features.see(there)
    np.testing.assert_allclose(one["positions"], other["positions"], atol=1e-9)
    np.testing.assert_allclose(np.abs((one["rotations"] * other["rotations"]).sum(-1)), 1.0, atol=1e-9)
    moves = [features.moves(each["hips"], each["before"], each["turn"]) for each in (one, other)]
    np.testing.assert_allclose(*moves, atol=1e-9)


def test_a_larger_copy_looks_the_same_in_its_own_unit_alone():
    small, large = dance("one"), dance("tall")
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


def test_windows_of_a_clip_have_the_path_of_the_clip():
    features = Features("body", "height", "removed")
    encoded = features.see(dance(frames=40))
    window = {key: array[13:33] for key, array in encoded.items()}
    moves = features.moves(window["hips"], window["before"], window["turn"])
    path = features.path(torch.from_numpy(moves), torch.from_numpy(window["turn"])).numpy()
    expected = window["hips"] - window["hips"][0] * [1.0, 0.0, 1.0]
    np.testing.assert_allclose(path, expected, atol=1e-9)


def test_says_why_a_body_is_none_that_it_knows():
    assert unfit(method_bodies.body()) == ""
    assert unfit(method_bodies.body(spines=2)) == ""
    assert "left_hand" in unfit(method_bodies.without(method_bodies.body(), "LeftHand"))
    assert unfit(method_bodies.body(spines=5)) == ""
