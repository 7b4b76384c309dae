"""Any file to metres, Y up: what is written in another unit or axis comes back as the same motion."""

from __future__ import annotations

import numpy as np
import pytest
from alignment_rigs import performance, t_pose

from retarget_bench.errors import BenchError, FileError, NotSupported, SkeletonError
from retarget_bench.motion import bvh, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.importer import UNITS, load
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.motion.up_axis import UP_AXES

FRAMES = 90


@pytest.fixture(scope="module")
def walk() -> Motion:
    """A body that stands and moves about on a floor at y = 0."""
    body = Character.of("walker", t_pose())
    path = np.linspace([0.0, 1.0, 0.0], [0.5, 0.95, 1.0], FRAMES)
    return body.motion(performance(body, FRAMES), path, 60.0)


def written(motion: Motion, path, *, unit: float = 1.0, turn: np.ndarray | None = None):
    """A BVH file of the motion in another unit, its world turned."""
    if turn is not None:
        rotations, offsets = np.array(motion.rotations), np.array(motion.skeleton.offsets)
        rotations[:, 0] = rotation.multiply(turn[None], rotations[:, 0])
        offsets[0] = rotation.rotate(turn, offsets[0])
        skeleton = Skeleton(motion.skeleton.names, motion.skeleton.parents, offsets)
        root = rotation.rotate(turn[None], motion.root)
        motion = Character.of("turned", skeleton).motion(rotations, root, motion.fps)
    bvh.write(path, motion, scale=1 / unit)
    return path


@pytest.mark.parametrize("unit", ["m", "cm", "mm", "dm", "cmu"])
def test_units_are_found_by_the_size_of_the_body(walk, tmp_path, unit):
    imported = load(written(walk, tmp_path / "a.bvh", unit=UNITS[unit]))
    assert imported.findings.unit == (unit, UNITS[unit])
    assert not imported.findings.unit_explicit
    np.testing.assert_allclose(imported.motion.positions, walk.positions, atol=2e-4)


@pytest.mark.parametrize(("unit", "metres"), [("inch", 0.0254), ("0.3048", 0.3048), ("mm", 0.001)])
def test_a_unit_can_be_told(walk, tmp_path, unit, metres):
    imported = load(written(walk, tmp_path / "a.bvh", unit=metres), Reading(unit=unit))
    assert imported.findings.unit == (unit, metres)
    assert imported.findings.unit_explicit
    np.testing.assert_allclose(imported.motion.positions, walk.positions, atol=1e-3)


@pytest.mark.parametrize("axis", UP_AXES)
def test_up_axes_are_found_from_feet_to_head(walk, tmp_path, axis):
    """Written with another axis up and read again: the same motion, exactly where it was."""
    turn = rotation.conjugate(rotation.from_rotation_vector(np.array(UP_AXES[axis])))
    path = written(walk, tmp_path / "a.bvh", turn=turn)
    for imported in (load(path), load(path, Reading(up=axis))):
        assert imported.findings.up == axis
        np.testing.assert_allclose(imported.motion.positions, walk.positions, atol=1e-5)
        assert imported.motion.character.measures.root_offset == pytest.approx(1.0)
        assert imported.findings.floor == pytest.approx(lowest_foot(walk), abs=1e-5)
    assert imported.findings.up_explicit


@pytest.mark.parametrize("axis", ["y", "z"])
def test_who_lies_on_the_floor_does_not_stand(walk, tmp_path, axis):
    """On its back along Z the whole time; in a file with Z up the rest pose stands along Z."""
    body = walk.character
    down = rotation.about(np.array([1.0, 0.0, 0.0]), np.full(FRAMES, -np.pi / 2))
    rotations = np.repeat(body.reference_pose[None], FRAMES, 0)
    rotations[:, 0] = rotation.multiply(down, rotations[:, 0])
    lying = body.motion(rotations, np.tile([0.3, 0.1, 0.4], (FRAMES, 1)), 30.0)
    assert np.ptp(lying.positions[0, :, 1]) < 0.3
    turn = rotation.conjugate(rotation.from_rotation_vector(np.array(UP_AXES[axis])))
    if axis == "z":  # the whole file turned, offsets included
        places = rotation.rotate(turn, np.array(body.skeleton.offsets))
        still = rotation.multiply(rotation.multiply(turn[None, None], rotations), rotation.conjugate(turn))
        skeleton = Skeleton(body.skeleton.names, body.skeleton.parents, places)
        turned = Character.of("turned", skeleton)
        lying = turned.motion(still, rotation.rotate(turn[None], lying.root), 30.0)
    bvh.write(tmp_path / "a.bvh", lying)
    assert load(tmp_path / "a.bvh").findings.up == axis


def lowest_foot(motion: Motion) -> float:
    feet = [j for j, name in enumerate(motion.skeleton.names) if "Foot" in name or "Toe" in name]
    return float(np.median(motion.positions[:, feet, 1].min(axis=1)))


def test_frame_rate_and_name(walk, tmp_path):
    path = written(walk, tmp_path / "strange name.bvh")
    assert load(path).motion.character.name == "strange name"
    imported = load(path, fps=30.0, name="walker")
    assert (imported.motion.fps, imported.motion.frames) == (30.0, FRAMES // 2)
    assert (imported.findings.fps, imported.findings.frames) == (pytest.approx(60.0, rel=1e-4), FRAMES)
    assert imported.motion.character.name == "walker"
    np.testing.assert_allclose(imported.motion.positions, walk.positions[::2], atol=1e-5)


def test_roles_can_be_told_by_a_table_or_a_file(walk, tmp_path):
    path = written(walk, tmp_path / "a.bvh")
    text = path.read_text().replace("HeadTop_End", "Gizmo")
    path.write_text(text)
    assert "head_top" not in load(path).motion.character.joint_of
    roles = tmp_path / "roles.toml"
    roles.write_text('Gizmo = "head_top"\n')
    for overrides in ({"Gizmo": "head_top"}, roles, str(roles)):
        body = load(path, Reading(roles=overrides)).motion.character
        assert body.skeleton.names[body.joint_of["head_top"]] == "Gizmo"
    with pytest.raises(SkeletonError, match="no joint 'Gismo'"):
        load(path, Reading(roles={"Gismo": "head_top"}))


def test_options_that_do_not_exist_are_named(walk, tmp_path):
    path = written(walk, tmp_path / "a.bvh")
    with pytest.raises(NotSupported, match="unit='ell' is not known; it is auto, m, cm"):
        load(path, Reading(unit="ell"))
    with pytest.raises(NotSupported, match="unit='-1'"):
        load(path, Reading(unit="-1"))
    with pytest.raises(NotSupported, match="up='w' is not known; it is auto, y, z"):
        load(path, Reading(up="w"))
    with pytest.raises(BenchError, match="root_place: 'both' is not known"):
        load(path, Reading(root_place="both"))
    with pytest.raises(FileError):
        load(tmp_path / "none.bvh")


def test_a_skeleton_without_any_known_joint_is_still_read(tmp_path):
    path = tmp_path / "rope.bvh"
    rope = Skeleton(("a", "b"), np.array([-1, 0]), np.array([[0.0, 0.0, 0.0], [0.0, 1.7, 0.0]]))
    pose = Character.of("rope", rope).motion(rotation.identity(1, 2), np.zeros((1, 3)), 25.0)
    bvh.write(path, pose, scale=100.0)
    imported = load(path)
    assert imported.findings.unit[0] == "cm"
    assert imported.motion.skeleton.bone_lengths[1] == pytest.approx(1.7)
    assert set(imported.motion.character.roles) == {None}


REAL = {
    "mixamo_san/Aj/Praying.bvh": ("cm", "y", "T-pose"),
    "mixamo_san/Goblin_m/Praying.bvh": ("cm", "y", "T-pose"),
    "mixamo_r2et/Mousey/Angry.bvh": ("cm", "y", "T-pose"),
    "lafan1/dance1_subject1.bvh": ("cm", "y", "bones along"),
    "lafan1/ground1_subject5.bvh": ("cm", "y", "bones along"),
    "bandai_namco/dataset-1_bow_giant_001.bvh": ("cm", "y", "bones along"),
    "cmu_bvh/01_01.bvh": ("cmu", "y", "T-pose"),
    "cmu_bvh/131_01.bvh": ("cmu", "y", "arms down"),
    "cmu_bvh/pfnn_hierarchy.bvh": ("m", "y", "T-pose"),
    "cmu_iclone/002_01.bvh": ("cm", "y", "bones along"),
    "dog/D1_003_KAN01_001.bvh": ("cm", "y", "bones along"),
    "dog/D1_006_KAN01_002.bvh": ("cm", "y", "bones along"),
    "makehuman/makehuman/data/animations/walks/walk1.bvh": ("dm", "z", "T-pose, turned"),
    "makehuman/makehuman/data/poses/benchmark.bvh": ("dm", "z", "A-pose, turned"),
    "same_pairs/SFU/0005_JumpRope001_0.bvh": ("cm", "y", "T-pose"),
    "same_pairs/result/6.bvh": ("cm", "y", "T-pose"),
}


@pytest.mark.parametrize("file", REAL)
def test_units_axes_and_rest_poses_of_real_files(real_data, file):
    findings = load(real_data / file).findings
    unit, up, pose = REAL[file]
    assert (findings.unit[0], findings.up) == (unit, up)
    assert findings.rest_pose.startswith(pose)
    assert 0.6 < findings.height < 2.5
    assert not findings.doubts
