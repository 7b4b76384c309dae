"""Arrays of joint positions, and lists of motions, in ``rb.load_motion`` and ``rb.retarget``."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import retarget_bench as rb
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.smpl import skeletons
from retarget_bench.motion.files.smpl.skeletons import FAMILIES, H36M, SMPL
from tests.motion.smpl_files import danced

FRAMES = 20


@pytest.fixture
def positions() -> np.ndarray:
    """``(frames, 24, 3)`` metres of SMPL's joints."""
    return danced(Character.of("body", skeletons.average(SMPL)), FRAMES)


def quiet(function, *arguments, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".* the feet are mostly")  # of bodies that end in the ankles
        return function(*arguments, **options)


@pytest.mark.parametrize("joints", ["smpl", "SMPL", SMPL.joints, None])
def test_rotations_are_fitted_to_an_array(positions, joints):
    fitted = quiet(rb.load_motion, positions, joints=joints, rate=30, name="ada")
    assert (fitted.fps, fitted.frames, fitted.character.name) == (30.0, FRAMES, "ada")
    np.testing.assert_allclose(fitted.positions, positions, atol=1e-5)
    assert fitted.skeleton.names == SMPL.joints
    np.testing.assert_allclose(np.linalg.norm(fitted.rotations, axis=2), 1.0)


def test_some_of_the_joints_are_named_as_papers_do(positions):
    """The 17 joints of Human3.6M hang below each other as in that data set."""
    some = positions[:, [SMPL.joints.index(name) for name in H36M.joints]]
    by_name = quiet(rb.load_motion, some, joints="h36m", rate=50)
    parents = [-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 9, 8, 11, 12, 8, 14, 15]
    assert by_name.skeleton.parents.tolist() == parents
    assert np.linalg.norm(by_name.positions - some, axis=2).mean() < 0.01
    roles = [str(role) for role in by_name.character.roles]
    by_roles = quiet(rb.load_motion, some, joints=roles, rate=50)
    np.testing.assert_allclose(by_roles.positions, by_name.positions, atol=1e-9)
    assert by_roles.character.roles == by_name.character.roles


def test_unit_and_axis_of_an_array_are_found_or_said(positions):
    turned = 100 * positions[..., [0, 2, 1]] * [1, -1, 1]
    for stated in ({}, {"unit": "cm", "up": "z"}):
        loaded = quiet(rb.load_motion, turned, rate=30, **stated)
        np.testing.assert_allclose(loaded.positions, positions, atol=1e-4)
    with pytest.warns(UserWarning, match="array: the rate is not stated: 20 frames per second") as caught:
        rb.load_motion(positions)
    assert caught[0].filename == __file__


@pytest.mark.parametrize(
    ("array", "options", "message"),
    [
        (np.zeros((4, 17, 3)), {}, r"array: is of shape \(4, 17, 3\); joint positions of the SMPL"),
        (np.zeros((4, 17, 3)), {"joints": "smpl"}, r"positions of these joints are \(frames, 24, 3\)"),
        (np.zeros((4, 17, 3)), {"joints": "coco"}, "no skeleton is known as 'coco'; there are body, smpl"),
        (np.zeros((4, 2, 3)), {"joints": ["hips", "left_arn"]}, "'left_arn' is no joint .* left_arm"),
        (np.zeros((4, 2, 3)), {"joints": ["pelvis", "pelvis"]}, "each is named once"),
        (np.zeros((4, 1, 3)), {"joints": ["left_hip"]}, "the hips .* are among them"),
        (np.full((4, 22, 3), np.nan), {}, "holds NaN or infinity"),
        (np.zeros((4, 22, 3)), {}, "has all joints in one place"),
        (np.zeros((0, 22, 3)), {}, "has no frames"),
        (np.array(["walk"]), {}, "has no joint positions; give one of numbers"),
        (np.zeros((4, 22, 3)), {"take": "2"}, "array holds one motion of one body: leave out take='2'"),
        ("walk.bvh", {"joints": "smpl"}, "walk.bvh: joints are said of arrays"),
        ([1, 2], {}, r"load_motion: path is \[1, 2\], of type list; it takes text or a path or an array"),
    ],
)
def test_arrays_that_hold_no_motion_are_refused_in_a_sentence(array, options, message):
    with pytest.raises(rb.BenchError, match=message):
        rb.load_motion(array, **options)


def test_an_array_is_retargeted_as_the_motion_that_it_is(positions, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    body = quiet(rb.load_character, positions[:1] * 1.1, rate=30)
    motion = quiet(rb.load_motion, positions, rate=20)
    expected = rb.retarget(motion, body, "copy_rotations")
    with pytest.warns(UserWarning, match="the rate is not stated"):
        answer = rb.retarget(positions, body, "copy_rotations", joints="smpl")
    np.testing.assert_array_equal(answer.positions, expected.positions)
    assert answer.character is body
    answer.save("out.bvh")
    again = rb.load_motion("out.bvh", unit="m")
    order = [again.skeleton.index(name) for name in answer.skeleton.names]
    np.testing.assert_allclose(again.positions[:, order], answer.positions, atol=1e-4)


def test_a_list_gives_a_list(positions):
    body = quiet(rb.load_character, positions[:1] * 1.1, rate=30)
    walks = [quiet(rb.load_motion, some, rate=30) for some in (positions, positions[5:])]
    answers = rb.retarget(walks, body, "copy_rotations")
    assert [each.frames for each in answers] == [FRAMES, FRAMES - 5]
    for source, answer in zip(walks, answers, strict=True):
        one = rb.retarget(source, body, "copy_rotations")
        np.testing.assert_array_equal(answer.positions, one.positions)
    assert rb.retarget([], body) == []
    with pytest.raises(rb.BenchError, match="retarget: source is "):
        rb.retarget([walks[0], 3], body)


def test_families_are_as_before():
    """Parents of SMPL's first joints as its published kinematic tree has them."""
    tree = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]
    assert all(list(family.parents[:22]) == tree for family in FAMILIES)
