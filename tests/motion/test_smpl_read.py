"""AMASS archives and joint arrays against SMPL's equations as loops, scipy and HumanML3D's definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from smpl_files import archive, danced, features, forward, model, parameters

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion import files, importer, kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.files.smpl import arrays, skeletons
from retarget_bench.motion.files.smpl.skeletons import BODY, FAMILIES, SMPL, SMPLH, SMPLX
from retarget_bench.motion.role_finding import find
from retarget_bench.motion.structures import BODY22
from retarget_bench.motion.up_axis import UP_AXES

COMPLETE = (SMPL, SMPLH, SMPLX)


@pytest.fixture
def random():
    return np.random.default_rng(3)


def places(recording) -> np.ndarray:
    return kinematics.forward(recording.skeleton, recording.rotations, recording.root)[0]


@pytest.mark.parametrize("family", COMPLETE, ids=lambda each: each.word)
def test_joints_and_skin_are_where_the_body_model_puts_them(tmp_path, random, family):
    content, body = parameters(random, family), model(random, family, vertices=60 + 2 * len(family))
    file = archive(tmp_path / "a.npz", content)
    recording = files.read(file, Reading(body_model=str(archive(tmp_path / "model.npz", body))))
    joints, vertices = forward(body, family, content)
    np.testing.assert_allclose(places(recording), joints, atol=1e-12)
    assert recording.fps == 120.0
    motion = importer.load(file, Reading(body_model=tmp_path / "model.npz")).motion
    turn = rotation.from_rotation_vector(np.array(UP_AXES["z"]))  # Y up, from the file's Z up
    np.testing.assert_allclose(motion.positions, rotation.rotate(turn, joints), atol=1e-12)
    skinned = motion.character.mesh.skinned(motion)
    np.testing.assert_allclose(skinned, rotation.rotate(turn, vertices), atol=1e-12)


def test_dialects_hold_the_same_motion(tmp_path, random):
    """Names of AIST++, with translations of a body of another size; rotation matrices; another name of the
    rate."""
    content = parameters(random, SMPL)
    poses, trans, rate = (content.pop(name) for name in ("poses", "trans", "mocap_framerate"))
    matrices = Rotation.from_rotvec(poses.reshape(-1, 3)).as_matrix().reshape(len(poses), -1, 3, 3)
    dialects = (
        {"poses": poses, "trans": trans, "mocap_framerate": rate},
        {
            "smpl_poses": poses,
            "smpl_trans": 90 * trans,
            "smpl_scaling": np.array([90.0]),
            "fps": np.array(120),
        },
        {"poses": matrices, "trans": trans, "fps": np.array([120.0])},
        {"poses": matrices.reshape(len(poses), -1), "transl": trans, "mocap_frame_rate": rate},
        {"global_orient": matrices[:, :1], "body_pose": matrices[:, 1:], "transl": trans, "fps": rate},
        {"pose": poses, "trans": trans, "frame_rate": rate},
        {"fullpose": poses, "trans": trans, "framerate": rate},
    )
    expected, *others = (
        files.read(archive(tmp_path / f"{number}.npz", content | dialect))
        for number, dialect in enumerate(dialects)
    )
    for recording in others:
        np.testing.assert_allclose(places(recording), places(expected), atol=1e-12)
        assert (recording.fps, recording.rate_stated) == (120.0, True)
        assert recording.doubts == expected.doubts


@pytest.mark.parametrize("family", FAMILIES, ids=lambda each: each.name)
def test_all_joints_have_the_roles_that_their_names_mean(family):
    assert len(family) == {BODY: 22, SMPL: 24, SMPLH: 52, SMPLX: 55}[family]
    roles = find(skeletons.average(family))
    assert set(BODY22) <= set(roles)
    as_role = {
        "pelvis": "hips",
        "left_foot": "left_toe",
        "spine3": "spine_3",
        "right_collar": "right_shoulder",
    }
    as_role |= {
        "left_pinky2": "left_pinky_2",
        "right_thumb1": "right_thumb_1",
        "jaw": None,
        "left_hand": None,
    }
    by_joint = dict(zip(family.joints, roles, strict=True))
    assert all(by_joint[joint] == role for joint, role in as_role.items() if joint in by_joint)
    assert sum(role is None for role in roles) == {BODY: 0, SMPL: 2, SMPLH: 0, SMPLX: 3}[family]


def test_turns_are_rotation_vectors_about_joints_of_the_average_skeleton(tmp_path, random):
    """scipy's; angles above pi are in AMASS, too."""
    content = parameters(random, SMPLH)
    content["poses"][:, 30:33] = [[3.0, 2.0, 1.0]]
    recording = files.read(archive(tmp_path / "a.npz", content))
    expected = Rotation.from_rotvec(content["poses"].reshape(-1, 3))
    turned = Rotation.from_quat(recording.rotations.reshape(-1, 4)[:, [1, 2, 3, 0]])
    assert (expected.inv() * turned).magnitude().max() < 1e-12
    np.testing.assert_array_equal(recording.root, content["trans"])
    assert "an average skeleton: say body_model=FILE" in recording.doubts[0]
    imported = importer.load(tmp_path / "a.npz")
    assert imported.findings.rest_pose == "T-pose"
    assert imported.findings.up == "z"
    assert 1.4 < imported.findings.height < 1.8


def test_parts_of_poses_mean_the_same_as_all_of_them(tmp_path, random):
    content = parameters(random, SMPLX)
    complete = files.read(archive(tmp_path / "whole.npz", content))
    poses = content.pop("poses")
    cut = {"root_orient": 3, "pose_body": 63, "pose_jaw": 3, "pose_eye": 6, "pose_hand": 90}
    parts = dict(zip(cut, np.split(poses, np.cumsum(list(cut.values()))[:-1], axis=1), strict=True))
    recording = files.read(archive(tmp_path / "parts.npz", content | parts))
    np.testing.assert_array_equal(recording.rotations, complete.rotations)
    few = {"global_orient": parts["root_orient"], "body_pose": parts["pose_body"]}
    few |= {"transl": content["trans"], "betas": np.tile(content["betas"], (12, 1))}
    recording = files.read(archive(tmp_path / "few.npz", few))
    assert recording.skeleton.names == BODY.joints
    np.testing.assert_array_equal(recording.rotations, complete.rotations[:, :22])
    assert recording.fps == 30.0
    assert any("mocap_framerate" in each and "rate=" in each for each in recording.doubts)
    body = archive(tmp_path / "model.npz", model(random, SMPLX, 170))
    dressed = files.read(tmp_path / "few.npz", Reading(body_model=str(body)))
    assert dressed.skeleton.names == SMPLX.joints
    expected, _ = forward(
        dict(np.load(body, allow_pickle=True)),
        SMPLX,
        content | {"poses": np.pad(poses[:, :66], ((0, 0), (0, 99)))},
    )
    np.testing.assert_allclose(places(dressed), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("stated", "expected"),
    [
        ("male", "male"),
        (b"male", "male"),
        (["MALE"], "male"),
        ("b'male'", "male"),
        ("x", "neutral"),
        (1, "neutral"),
    ],
)
def test_genders_are_known_in_every_spelling(tmp_path, random, stated, expected):
    content = parameters(random) | {"gender": np.array(stated)}
    notes = files.read(archive(tmp_path / "a.npz", content)).notes
    assert notes[0] == f"SMPL-H, {expected}, 16 betas"
    assert (len(notes) > 1) == (expected == "neutral")


def test_the_rate_is_the_file_s_unless_it_is_told(tmp_path, random):
    content = parameters(random)
    del content["mocap_framerate"]
    file = archive(tmp_path / "a.npz", content | {"mocap_frame_rate": np.array(59.94)})
    assert importer.load(file).motion.fps == 59.94
    assert importer.load(file, Reading(rate=50)).motion.fps == 50.0
    half = importer.load(file, Reading(rate=60), fps=30).motion
    assert (half.fps, half.frames) == (30.0, 6)
    with pytest.raises(NotSupported, match="is no frame rate"):
        importer.load(file, Reading(rate=-1))
    broken = archive(tmp_path / "b.npz", content | {"mocap_framerate": np.array(0.0)})
    with pytest.raises(FileError, match=r"'mocap_framerate' = 0, which is no frame rate"):
        importer.load(broken)
    assert importer.load(broken, Reading(rate=30)).motion.fps == 30.0


@pytest.mark.parametrize(
    ("name", "family"),
    [
        ("SMPLH_FEMALE.npz", SMPLH),
        ("smplh/female/model.npz", SMPLH),
        ("female/model.npz", SMPLH),
        ("models/smplx/SMPLX_FEMALE.npz", SMPLX),
        ("smpl/basicmodel_f_lbs_10_207_0_v1.1.0.npz", SMPL),
    ],
)
def test_a_folder_of_body_models_is_searched_for_family_and_gender(tmp_path, random, name, family):
    content = parameters(random, family)
    folder = tmp_path / "models"
    expected = model(random, family, 170)
    archive(folder / name, expected)
    for other in ("dmpls/female/model.npz", "SMPLX_MALE.npz", "smplh/male/model.npz", "SMPL_NEUTRAL.npz"):
        archive(folder / other, {"eigvec": np.zeros(3)})
    recording = files.read(archive(tmp_path / "a.npz", content), Reading(body_model=str(folder)))
    np.testing.assert_allclose(places(recording), forward(expected, family, content)[0], atol=1e-12)
    with pytest.raises(FileError, match="has no male"):
        files.read(
            archive(tmp_path / "b.npz", content | {"gender": b"male"}), Reading(body_model=str(folder))
        )


def test_pickled_models_are_never_opened(tmp_path, random):
    file = archive(tmp_path / "a.npz", parameters(random))
    folder = tmp_path / "models"
    folder.mkdir()
    (folder / "SMPLH_FEMALE.pkl").write_bytes(b"cos\nsystem\n(S'touch opened'\ntR.")
    for place in (folder, folder / "SMPLH_FEMALE.pkl"):
        with pytest.raises(
            FileError, match=r"SMPLH_FEMALE\.pkl: is a pickle, .* is never loaded: take the"
        ):
            files.read(file, Reading(body_model=str(place)))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"v_template": None}, "is no SMPL body model: it lacks v_template"),
        ({"v_template": np.zeros((90, 2))}, r"'v_template' of shape \(90, 2\); \(90, 3\) is needed"),
        ({"v_template": np.full((90, 3), np.nan)}, "'v_template' holds NaN"),
        ({"shapedirs": np.zeros((90, 3))}, "'shapedirs' of shape"),
        ({"shapedirs": np.full((90, 3, 10), 1e9)}, "gives a body beyond 1000 m"),
        ({"J_regressor": np.full((52, 90), 1e300)}, "gives a body beyond 1000 m"),
        ({"J_regressor": np.zeros((51, 90))}, "has a J_regressor of shape"),
        ({"J_regressor": np.zeros((52, 89))}, "'J_regressor' of shape"),
        ({"J_regressor": np.array([{}])}, "'J_regressor' is a pickled object, which is never loaded"),
        ({"kintree_table": np.zeros((2, 52))}, "kintree_table that is not that of SMPL-H"),
        ({"f": np.full((3, 3), 90)}, "faces .'f'. with vertices that it has not"),
        ({"weights": np.zeros((90, 52))}, "'weights' that are no shares of 1"),
        ({"weights": np.zeros((90, 51))}, "'weights' of shape"),
    ],
)
def test_what_is_wrong_with_a_body_model_is_said(tmp_path, random, change, sentence):
    content = {name: each for name, each in (model(random) | change).items() if each is not None}
    file, place = archive(tmp_path / "a.npz", parameters(random)), archive(tmp_path / "m.npz", content)
    with pytest.raises(FileError, match=rf"m\.npz: .*{sentence}"):
        files.read(file, Reading(body_model=str(place))).skin()


def test_a_body_model_of_another_family_or_for_another_format_is_refused(tmp_path, random):
    body = archive(tmp_path / "m.npz", model(random, SMPLX, 170))
    with pytest.raises(FileError, match="is a model of SMPL-X, and the motion is of SMPL-H"):
        files.read(archive(tmp_path / "a.npz", parameters(random)), Reading(body_model=str(body)))
    np.save(tmp_path / "a.npy", np.zeros((3, 22, 3)))
    with pytest.raises(NotSupported, match="a body model is for AMASS files"):
        files.read(tmp_path / "a.npy", Reading(body_model=str(body)))
    (tmp_path / "m.txt").write_text("x")
    with pytest.raises(FileError, match="is not NPZ but text of an unknown kind"):
        files.read(tmp_path / "a.npz", Reading(body_model=str(tmp_path / "m.txt")))


@pytest.fixture(scope="module")
def joints() -> np.ndarray:
    """``(200, 22, 3)`` of the average body, Y up."""
    return danced(Character.of("body", skeletons.average(BODY)))


def test_rotations_are_fitted_to_joint_positions(tmp_path, joints):
    np.save(tmp_path / "a.npy", joints.astype(np.float32))
    imported = importer.load(tmp_path / "a.npy")
    np.testing.assert_allclose(imported.motion.positions, joints, atol=1e-6)
    assert (imported.motion.fps, imported.findings.up, imported.findings.unit[0]) == (20.0, "y", "m")
    assert any(
        each.startswith("rotations were fitted to joint positions: less")
        for each in imported.findings.notes
    )
    assert any("say rate=30 for Motion-X" in each for each in imported.findings.warnings)
    explicit = importer.load(tmp_path / "a.npy", Reading(rate=30))
    assert explicit.motion.fps == 30.0
    assert not any("rate=" in each for each in explicit.findings.warnings)


@pytest.mark.parametrize("unit", [1.0, 100.0])
def test_the_axes_and_unit_of_joint_positions_are_found(tmp_path, joints, unit):
    np.save(tmp_path / "a.npy", unit * joints[..., [0, 2, 1]] * [1, -1, 1])  # Z up
    imported = importer.load(tmp_path / "a.npy")
    assert imported.findings.up == "z"
    np.testing.assert_allclose(imported.motion.positions, joints, atol=1e-6)


def test_bones_are_as_long_as_the_positions_show_and_lie_as_they_do(tmp_path, random):
    """Of a body that is nothing like the average one, with noise of 2 mm."""
    skeleton = skeletons.average(BODY)
    offsets = np.array(skeleton.offsets) * random.uniform(0.7, 1.4, (22, 1))
    offsets[[1, 2, 3]] += 0.05 * random.normal(size=(3, 3))
    body = Character.of("body", type(skeleton)(skeleton.names, skeleton.parents, offsets))
    expected = danced(body)
    np.save(tmp_path / "a.npy", expected + 0.002 * random.normal(size=expected.shape))
    motion = importer.load(tmp_path / "a.npy").motion
    np.testing.assert_allclose(motion.skeleton.bone_lengths[1:], body.skeleton.bone_lengths[1:], atol=2e-3)
    assert np.linalg.norm(motion.positions - expected, axis=2).mean() < 0.003


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), frames=st.integers(2, 40), turns=st.floats(0, 3))
def test_positions_come_back_from_features(seed, frames, turns):
    random = np.random.default_rng(seed)
    positions = random.normal(size=(frames + 1, 22, 3))
    headings = np.cumsum(np.clip(turns * random.normal(size=frames + 1), -3, 3))
    restored = arrays.from_features(features(positions, headings))
    begins = Rotation.from_euler("y", -headings[0])
    expected = positions[:-1] - positions[0, 0] * [1, 0, 1]
    expected = begins.apply(expected.reshape(-1, 3)).reshape(expected.shape)
    np.testing.assert_allclose(restored, expected, atol=1e-9)


def test_features_are_read_as_the_motion_that_they_were_made_of(tmp_path, joints):
    headings = np.cumsum(np.full(200, 0.03))
    columns = features(joints, headings)
    np.save(tmp_path / "a.npy", columns)
    imported = importer.load(tmp_path / "a.npy", Reading(rate=20))
    assert imported.findings.up_prescribed
    assert imported.findings.warnings == ()
    heading = Rotation.from_euler("y", -headings[0])
    expected = heading.apply((joints[:-1] - joints[0, 0] * [1, 0, 1]).reshape(-1, 3)).reshape(199, 22, 3)
    np.testing.assert_allclose(imported.motion.positions, expected, atol=1e-6)
    np.save(tmp_path / "b.npy", (columns - columns.mean(axis=0)) / columns.std(axis=0))
    warnings = importer.load(tmp_path / "b.npy").findings.warnings
    assert any("multiplied by Std and moved by Mean" in each for each in warnings)
