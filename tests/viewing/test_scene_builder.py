"""Scenes of cases, stored and asked now, and of files: what is told of every figure."""

from __future__ import annotations

import numpy as np
import pytest
from acted import clad_scene
from small_runs import CASE, bvh_file, ran, toys
from viewing_toys.toy_moves import DOG, PERSON

from retarget_bench.errors import BenchError, FileError
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import predictions
from retarget_bench.viewer import scene_builder
from tests.engine.small_plans import asked
from tests.in_process import run_here
from tests.motion import smpl_files


@pytest.fixture(autouse=True)
def _toys():
    toys()


def test_a_case_has_source_reference_and_methods_in_their_order(tmp_path):
    places = ran(tmp_path, "positions", "copy", "peek")
    scene = scene_builder.of_case(places, CASE)
    assert [figure.part for figure in scene.figures] == ["source", "reference", *["prediction"] * 3]
    labels = [figure.label for figure in scene.figures[2:]]
    assert labels == ["toy_method[does=positions]", "toy_method", "toy_method[does=peek]"]
    assert (scene.case, scene.split, scene.kind) == (CASE, "intra", "nodding")
    assert (scene.frames, scene.fps) == (12, 30)
    source, reference, positions, copied, peeked = scene.figures
    assert (source.character.name, copied.character.name) == ("small", "tall")
    assert positions.motion is None  # it said where joints are, not how they are turned
    assert copied.motion is not None
    assert np.allclose(peeked.positions, reference.positions, atol=1e-6)


def test_errors_are_those_of_the_rows(tmp_path):
    places = ran(tmp_path, "copy")
    scene = scene_builder.of_case(places, CASE)
    copied = scene.figures[2]
    row = scene.values["toy_method"]["mpjpe_h.world"]
    assert row > 1
    assert copied.error.mean() == pytest.approx(row, rel=1e-6)
    assert np.nanmean(copied.joint_error) == pytest.approx(row, rel=1e-6)
    hips = np.linalg.norm(copied.positions[:, 0] - scene.figures[1].positions[:, 0], axis=1).mean()
    assert copied.joint_error[0] == pytest.approx(100 * hips / copied.character.height, rel=1e-6)


@pytest.mark.parametrize(
    ("does", "status", "words"),
    [
        ("raise", "failed", "out of ideas"),
        ("nan", "invalid", "not finite"),
        ("nothing", "invalid", "NoneType"),
    ],
)
def test_what_failed_is_told_and_not_drawn(tmp_path, does, status, words):
    scene = scene_builder.of_case(ran(tmp_path, "copy", does), CASE)
    lost = scene.figures[3]
    assert (lost.positions, lost.status, lost.error) == (None, status, None)
    assert words in lost.message
    assert scene.figures[2].positions is not None


def test_a_prediction_that_is_gone_or_not_the_scored_one_is_missing(tmp_path):
    (place,) = ran(tmp_path, "copy")
    path = place.prediction(CASE)
    answer = scene_builder.of_case([place], CASE).figures[2].motion
    predictions.write_prediction(path, answer, "another key")
    other = scene_builder.of_case([place], CASE).figures[2]
    assert (other.positions, other.status) == (None, "missing")
    assert "not the one that was scored" in other.message
    path.unlink()
    missing = scene_builder.of_case([place], CASE).figures[2]
    assert (missing.positions, missing.status) == (None, "missing")
    assert "bench run makes it again" in missing.message


def test_one_frame_has_errors_and_no_contact(tmp_path):
    scene = scene_builder.of_case(ran(tmp_path, "copy", data="toy_moves[frames=1]"), CASE)
    assert scene.frames == 1
    assert scene.figures[2].error.shape == (1,)
    assert not scene.figures[2].planted.any()


def test_a_dog_has_four_feet(tmp_path):
    scene = scene_builder.of_case(ran(tmp_path, "copy", data="toy_moves[four_legged=true]"), CASE)
    dog = scene.figures[2]
    assert dog.character.four_legged
    names = {dog.character.roles[joint] for joint in dog.joints}
    assert names == {"left_hand", "right_hand", "left_foot", "right_foot"}


def test_an_unknown_case_is_a_sentence_with_near_ones(tmp_path):
    places = ran(tmp_path, "copy")
    with pytest.raises(
        BenchError, match=r"no case 'toy_moves/small>tall/nod'; near it: toy_moves/small>tall"
    ):
        scene_builder.of_case(places, "toy_moves/small>tall/nod")
    with pytest.raises(BenchError, match="no case is called 'nothing'"):
        scene_builder.of_case_asked(Spec("toy_moves"), "nothing", [])


def test_asked_now_is_what_is_stored(tmp_path):
    stored = scene_builder.of_case(ran(tmp_path, "noise", "raise"), CASE)
    specs = [Spec.parse("toy_method[does=noise]"), Spec.parse("toy_method[does=raise]")]
    computed = scene_builder.of_case_asked(Spec("toy_moves"), CASE, specs)
    assert np.allclose(computed.figures[2].positions, stored.figures[2].positions, atol=1e-6)
    assert computed.figures[3].message == stored.figures[3].message
    assert [figure.label for figure in computed.figures] == [figure.label for figure in stored.figures]


def test_files_are_brought_to_the_first_rate_and_the_shortest_length(tmp_path):
    slow = bvh_file(tmp_path / "slow.bvh", frames=30, fps=30)
    quick = bvh_file(tmp_path / "quick.bvh", frames=40, fps=60)
    scene = scene_builder.of_files([slow, quick])
    assert (scene.fps, scene.frames) == (pytest.approx(30, rel=1e-3), 20)
    first, second = scene.figures
    assert [first.label, second.label] == ["slow", "quick"]
    assert first.message == "the first 20 of 30 frames"
    assert second.message == "brought from 60 to 30 frames per second"
    assert np.allclose(first.positions, second.positions, atol=1e-4)


def test_one_file_is_shown_as_it_is(tmp_path):
    (figure,) = scene_builder.of_files([bvh_file(tmp_path / "dog.bvh", 5, 60, DOG)], ["<a dog>"]).figures
    assert (figure.label, figure.part, figure.message) == ("<a dog>", "motion", "")
    assert figure.character.four_legged
    assert figure.positions.shape == (5, len(DOG), 3)


def test_a_prediction_file_borrows_the_bones_of_a_file_that_has_its_joints(tmp_path):
    dog = bvh_file(tmp_path / "dog.bvh", 5, 30, DOG)
    person = bvh_file(tmp_path / "person.bvh", 5, 30)
    (place,) = ran(tmp_path / "runs", "positions")
    answer = place.prediction(CASE)
    scene = scene_builder.of_files([answer, dog, person], ["answer", "dog", "person"])
    assert scene.figures[0].character.skeleton.names == tuple(PERSON)
    assert scene.figures[0].motion is None
    assert np.allclose(scene.figures[0].positions, np.load(answer)["positions"][:5])
    with pytest.raises(FileError, match="has joints that no motion file beside it has: give"):
        scene_builder.of_files([answer, dog])
    with pytest.raises(FileError, match="holds no bones: give a motion file"):
        scene_builder.of_files([answer])


def test_an_archive_of_amass_is_shown_as_a_motion_beside_predictions(tmp_path):
    file = smpl_files.archive(tmp_path / "a.npz", smpl_files.parameters(np.random.default_rng(1)))
    (place,) = ran(tmp_path / "runs", "positions")
    person = bvh_file(tmp_path / "person.bvh", 5, 120)
    dog = bvh_file(tmp_path / "dog.bvh", 5, 120, DOG)
    scene = scene_builder.of_files([file, place.prediction(CASE), person, dog])
    assert scene.figures[0].positions.shape[1:] == (52, 3)
    assert scene.figures[1].character.skeleton.names == tuple(PERSON)


def test_files_that_cannot_be_shown_are_told_in_words(tmp_path):
    for name, content, says in (
        ("notes.txt", b"hello", "is not BVH: it begins with 'hello'"),
        ("broken.npz", b"hello", "text of an unknown kind"),
        ("packed.npz", b"\x1f\x8b\x08\0", "gzip-compressed: unpack it first"),
    ):
        file = tmp_path / name
        file.write_bytes(content)
        with pytest.raises(FileError, match=says):
            scene_builder.of_files([file])
    renamed = bvh_file(tmp_path / "walk.txt", 5)
    assert scene_builder.of_files([renamed]).frames == 5, "a file is what it holds"
    with pytest.raises(BenchError, match="no file"):
        scene_builder.of_files([])


def test_skins_of_positions_follow_rotations_that_are_fitted_to_them():
    original = clad_scene()
    clad, places, bare = scene_builder.dressed(original).figures
    assert clad.motion is original.figures[0].motion
    assert bare is original.figures[2]
    assert np.array_equal(places.positions, original.figures[1].positions)
    # these places are those of a motion of the same body: the fit finds them again, and the skin with them
    assert np.abs(places.motion.positions - places.positions).max() < 0.01
    assert "fitted" in places.message
    assert "cm mean" in places.message
    again = scene_builder.dressed(scene_builder.dressed(original))
    assert again.figures[1].message == places.message


def test_the_reference_is_shown_once_where_the_control_of_that_name_was_run(tmp_path):
    places = run_here(asked(tmp_path, "reference", "toy_method", data="toy_moves"))
    scene = scene_builder.of_case(places, CASE)
    assert [figure.label for figure in scene.figures] == ["source", "reference", "toy_method"]
    assert scene.values["toy_method"]["mpjpe_h.world"] > 1
    assert scene.values["reference"]["mpjpe_h.world"] < 1e-3
