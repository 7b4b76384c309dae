"""AMASS archives that are written: read by NumPy alone, and again by us."""

from __future__ import annotations

import numpy as np
import pytest
from gltf_files import person
from scipy.spatial.transform import Rotation
from smpl_files import archive, model, parameters

from retarget_bench.errors import FileError
from retarget_bench.motion import importer, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.files import writing
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.files.smpl import skeletons
from retarget_bench.motion.files.smpl.skeletons import BODY, SMPL, SMPLH, SMPLX
from retarget_bench.motion.skeleton import Skeleton

DEGREES, METRES = 1e-4, 1e-5


@pytest.fixture
def random():
    return np.random.default_rng(4)


def differ(poses: np.ndarray, others: np.ndarray) -> float:
    """Degrees between two ``(frames, 3 joints)``."""
    turns = (Rotation.from_rotvec(each.reshape(-1, 3)) for each in (poses, others))
    return float(np.degrees((next(turns).inv() * next(turns)).magnitude().max()))


@pytest.mark.parametrize("modelled", [True, False])
@pytest.mark.parametrize("family", [SMPL, SMPLH, SMPLX], ids=lambda each: each.word)
def test_an_archive_in_and_out_is_the_same(tmp_path, random, family, modelled):
    content = parameters(random, family) | {"surface_model_type": np.array(family.word)}
    content["poses"][:, 9:12] = [[3.0, 2.0, 1.0]]  # beyond half a turn
    file = archive(tmp_path / "a.npz", content)
    place = archive(tmp_path / "model.npz", model(random, family, 170)) if modelled else None
    imported = importer.load(file, Reading(body_model=place))
    assert writing.write(tmp_path / "b.npz", imported.motion, imported) == ()
    written = np.load(tmp_path / "b.npz", allow_pickle=False)
    assert differ(written["poses"], content["poses"]) < DEGREES
    np.testing.assert_allclose(written["trans"], content["trans"], atol=METRES)
    for name in ("betas", "gender", "surface_model_type"):
        np.testing.assert_array_equal(written[name], content[name])
    assert written["mocap_framerate"] == written["mocap_frame_rate"] == 120
    again = importer.load(tmp_path / "b.npz", Reading(body_model=place)).motion
    np.testing.assert_allclose(again.positions, imported.motion.positions, atol=METRES)
    if family is SMPLX:
        names = ("root_orient", "pose_body", "pose_jaw", "pose_eye", "pose_hand")
        joined = np.concatenate([written[name] for name in names], axis=1)
        np.testing.assert_array_equal(joined, written["poses"])


def test_a_lying_body_is_read_again_as_it_was_written(tmp_path, random):
    """The file says which axis is up, so that nothing has to be guessed from the body."""
    content = parameters(random)
    content["poses"][:, :3] = [0.1, 0.2, 0.3]
    imported = importer.load(archive(tmp_path / "a.npz", content), Reading(up="z"))
    writing.write(tmp_path / "b.npz", imported.motion, imported)
    again = importer.load(tmp_path / "b.npz")
    assert (again.findings.up, again.findings.up_prescribed) == ("z", True)
    np.testing.assert_allclose(again.motion.positions, imported.motion.positions, atol=METRES)


@pytest.mark.parametrize("family", [BODY, SMPL, SMPLH, SMPLX], ids=lambda each: each.name)
def test_a_body_with_the_joints_of_the_family_is_written_as_it_turns(tmp_path, family):
    body = Character.of("me", skeletons.average(family))
    random = np.random.default_rng(1)
    turns = 0.2 * random.normal(size=(5, len(family), 3))
    motion = body.motion(rotation.from_rotation_vector(turns), np.array([[0.0, 0.9, 0.0]] * 5), 30.0)
    assert "betas are 0" in writing.write(tmp_path / "a.npz", motion)[0]
    written = np.load(tmp_path / "a.npz", allow_pickle=False)
    wide = len(SMPLH) if family is BODY else len(family)
    assert written["poses"].shape == (5, 3 * wide)
    assert differ(written["poses"][:, 3 : 3 * len(family)], turns[:, 1:].reshape(5, -1)) < DEGREES
    np.testing.assert_allclose(written["trans"], [[0, 0, 0.9]] * 5, atol=1e-12)  # Z up
    assert str(written["gender"]) == "neutral"
    again = importer.load(tmp_path / "a.npz").motion
    count = len(family)
    np.testing.assert_allclose(again.positions[:, :count], motion.positions, atol=METRES)


def test_joints_of_other_names_are_found_by_role(tmp_path):
    """The same body in other words, a prop on it, and joint frames of its own."""
    skeleton = skeletons.average(SMPL)
    random = np.random.default_rng(2)
    body = Character.of("me", skeleton)
    motion = body.motion(
        rotation.from_rotation_vector(0.2 * random.normal(size=(5, 24, 3))), np.zeros((5, 3)), 30.0
    )
    words = "Hips LeftUpLeg RightUpLeg Spine LeftLeg RightLeg Spine1 LeftFoot RightFoot Spine2 LeftToeBase"
    words += " RightToeBase Neck LeftShoulder RightShoulder Head LeftArm RightArm LeftForeArm RightForeArm"
    names = [*words.split(), "LeftHand", "RightHand", "LeftProp", "RightProp"]
    other = Character.of("you", Skeleton(tuple(names), skeleton.parents, skeleton.offsets))
    writing.write(tmp_path / "a.npz", other.motion(motion.rotations, motion.root, 30.0))
    again = importer.load(tmp_path / "a.npz", Reading(up="z")).motion
    np.testing.assert_allclose(again.positions[:, :22], motion.positions[:, :22], atol=METRES)


def test_a_body_with_other_joints_is_refused_in_a_sentence(tmp_path, random):
    imported = importer.load(person(random, frames=4).save(tmp_path / "a.glb"))
    with pytest.raises(FileError, match=r"not written: .* a lacks spine_2, spine_3.*choose \.bvh or \.glb"):
        writing.write(tmp_path / "b.npz", imported.motion, imported)
    assert not (tmp_path / "b.npz").exists()
    body = Character.of("me", skeletons.average(BODY))
    still = body.motion(rotation.identity(2, 22), np.full((2, 3), np.nan), 30.0)
    with pytest.raises(FileError, match="frame 1 of the motion holds NaN"):
        writing.write(tmp_path / "b.npz", still)
    assert not (tmp_path / "b.npz").exists()
