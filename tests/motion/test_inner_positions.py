"""Joints below the root that move against their parents: dropped, baked, or kept; in BVH and glTF alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from alignment_rigs import performance, t_pose
from gltf_files import person
from scipy.spatial.transform import Rotation

import retarget_bench as rb
from retarget_bench import cli
from retarget_bench.datasets.folder import Folder
from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion import bvh, importer, recording
from retarget_bench.motion.bvh.document import POSITIONS
from retarget_bench.motion.character import Character
from retarget_bench.motion.files import writing
from retarget_bench.motion.files.reading import Reading

FRAMES = 40
SWAY = 0.04 * np.sin(np.linspace(0.0, 9.0, FRAMES))
"""Metres that a joint moves to and fro."""


def swaying(path: Path, joint: str = "Spine1", sway: np.ndarray = SWAY, *, relative: bool = False) -> Path:
    """A body with position channels on every joint, of which one moves sideways on its parent."""
    body = Character.of("t", t_pose())
    root = np.tile([0.0, 1.0, 0.0], (FRAMES, 1))
    bvh.write(path, body.motion(performance(body, FRAMES), root, 30.0))
    plain = bvh.parse(path)
    hierarchy = plain.hierarchy
    channels = tuple((*POSITIONS, "Zrotation", "Xrotation", "Yrotation") for _ in hierarchy.names)
    values = np.zeros((FRAMES, len(hierarchy), 6))
    values[:, :, 3:] = np.delete(plain.values, range(3), axis=1).reshape(FRAMES, -1, 3)
    values[:, 1:, :3] = 0.0 if relative else hierarchy.offsets[1:]
    values[:, 0, :3] = plain.values[:, :3]
    values[:, hierarchy.names.index(joint), 0] += sway
    document = replace(
        plain, hierarchy=replace(hierarchy, channels=channels), values=values.reshape(FRAMES, -1)
    )
    bvh.write_document(path, document)
    return path


def places(path: Path, *, relative: bool = False) -> np.ndarray:
    """``(frames, joints, 3)`` in the world, by a plain loop over matrices."""
    document = bvh.parse(path)
    rows = document.values.reshape(document.frames, -1, 6)
    positions = np.zeros((document.frames, len(document.hierarchy), 3))
    turned = np.zeros((document.frames, len(document.hierarchy), 3, 3))
    for frame, row in enumerate(rows):
        for joint, parent in enumerate(document.hierarchy.parents):
            own = Rotation.from_euler("ZXY", row[joint, 3:], degrees=True).as_matrix()
            step = row[joint, :3] + (document.hierarchy.offsets[joint] if relative and joint else 0.0)
            above = turned[frame, parent] if joint else np.eye(3)
            turned[frame, joint] = above @ own
            positions[frame, joint] = (positions[frame, parent] if joint else 0.0) + above @ step
    return positions


@pytest.mark.parametrize("relative", [False, True])
def test_small_moves_are_dropped_and_told(tmp_path, relative):
    path = swaying(tmp_path / "a.bvh", relative=relative)
    imported = importer.load(path, Reading(unit="m"))
    (warning,) = (each for each in imported.findings.warnings if "against its parent" in each)
    assert "'Spine1' moves by up to 0.04 m" in warning
    assert "bones keep their length" in warning
    assert "choose" not in warning
    off = np.linalg.norm(imported.motion.positions - places(path, relative=relative), axis=2)
    assert f"joints by up to {off.max():.2g} m" in warning
    offsets = bvh.parse(path).hierarchy.offsets
    np.testing.assert_allclose(imported.motion.skeleton.offsets[1:], offsets[1:], atol=1e-9)
    explicit = importer.load(path, Reading(unit="m", inner_positions="drop"))
    assert not any("against" in each for each in explicit.findings.warnings)
    assert any("against" in each for each in explicit.findings.notes)
    np.testing.assert_array_equal(explicit.motion.rotations, imported.motion.rotations)


def test_large_moves_ask_to_choose(tmp_path):
    path = swaying(tmp_path / "a.bvh", sway=4 * SWAY)
    warnings = importer.load(path, Reading(unit="m")).findings.warnings
    assert any("% of its height: say inner_positions=bake" in each for each in warnings)
    with pytest.warns(UserWarning, match="say inner_positions=bake"):
        rb.load_motion(path, unit="m")
    with pytest.raises(BenchError, match="inner_positions: 'melt' is not known"):
        importer.load(path, Reading(inner_positions="melt"))
    with pytest.raises(FileError, match="which only the root may do"):
        bvh.read(path)


def test_baked_rotations_come_nearer_to_where_joints_are(tmp_path):
    path = swaying(tmp_path / "a.bvh")
    truth = places(path)
    dropped, baked = (
        importer.load(path, Reading(unit="m", inner_positions=way)) for way in ("drop", "bake")
    )
    np.testing.assert_array_equal(baked.motion.skeleton.offsets, dropped.motion.skeleton.offsets)
    before, after = (np.linalg.norm(each.motion.positions - truth, axis=2) for each in (dropped, baked))
    assert after.mean() < 0.3 * before.mean()
    assert any(f"{100 * after.max():.1f} cm worst" in note for note in baked.findings.notes)


@pytest.mark.parametrize("relative", [False, True])
def test_kept_positions_are_written_back(tmp_path, relative):
    path = swaying(tmp_path / "a.bvh", relative=relative)
    imported = importer.load(path, Reading(unit="m", inner_positions="keep"))
    assert writing.write(tmp_path / "b.bvh", imported.motion, imported, imported.places) == ()
    np.testing.assert_allclose(
        places(tmp_path / "b.bvh", relative=relative), places(path, relative=relative), atol=1e-5
    )
    dropped = importer.load(path, Reading(unit="m"))
    assert dropped.places is None
    writing.write(tmp_path / "c.bvh", dropped.motion, dropped)
    positions = places(tmp_path / "c.bvh", relative=relative)
    np.testing.assert_allclose(positions, dropped.motion.positions, atol=1e-5)
    halved = importer.load(path, Reading(unit="m", inner_positions="keep"), fps=15.0)
    np.testing.assert_allclose(halved.places, imported.places[::2])
    bvh.write(tmp_path / "plain.bvh", dropped.motion)  # position channels of the root alone
    plain = importer.load(tmp_path / "plain.bvh", Reading(unit="m"))
    (note,) = writing.write(tmp_path / "d.bvh", imported.motion, plain, imported.places)
    assert note == "no position channels in the target's file, so positions are left out: Spine1"


@pytest.mark.filterwarnings("ignore:.*copy_rotations is worse", "ignore:.*above the floor")
def test_kept_positions_go_to_the_same_body_and_no_other(tmp_path):
    path = swaying(tmp_path / "a.bvh")
    still = swaying(tmp_path / "still.bvh", sway=0 * SWAY)
    walk = rb.load_motion(path, unit="m", inner_positions="keep")
    body = rb.load_character(still, unit="m")
    same = rb.retarget(walk, body, "copy_rotations")
    same.save(tmp_path / "same.bvh")
    np.testing.assert_allclose(places(tmp_path / "same.bvh"), places(path), atol=1e-5)
    assert same.resample(15.0).places.shape[0] == FRAMES // 2
    other = rb.load_character(person(np.random.default_rng(2)).save(tmp_path / "o.glb"))
    with pytest.warns(UserWarning, match="inner joints are left out"):
        same.save(tmp_path / "new.glb")
    moved = rb.retarget(walk, other, "copy_rotations")
    assert moved.places is None
    assert any("another body" in note for note in moved.notes)


def test_glb_files_go_the_same_way(tmp_path):
    asset = person(np.random.default_rng(3))
    times = np.arange(12) / 30
    place = np.array(asset.content["nodes"][5]["translation"])
    away = place + 0.03 * np.sin(times[:, None] * 9) * [1, 0, 0]
    asset.animate("stretch", {(5, "translation"): (times, away)})
    path = asset.save(tmp_path / "a.glb")
    imported = importer.load(path, Reading(take="stretch"))
    assert any("'LeftArm' moves by up to 0.029" in each for each in imported.findings.warnings)
    kept = importer.load(path, Reading(take="stretch", inner_positions="keep"))
    writing.write(tmp_path / "b.glb", kept.motion, kept, kept.places)
    again = importer.load(tmp_path / "b.glb", Reading(inner_positions="keep"))
    np.testing.assert_allclose(again.places, kept.places, atol=1e-6)
    joint = kept.motion.skeleton.index("LeftArm")
    swing = kept.places[:, joint] - kept.places[:1, joint]
    np.testing.assert_allclose(  # the parent's turn at rest does not change lengths
        np.linalg.norm(swing, axis=1), np.linalg.norm(away - away[:1], axis=1), atol=1e-5
    )


def test_bones_keep_what_is_stated_only_where_it_is_meant():
    positions = np.array([[[0.0, 9.0, 0.0]], [[0.0, 10.0, 0.0]], [[0.0, 12.0, 0.0]]])
    stated = np.array([[0.0, 11.0, 0.0]])
    np.testing.assert_array_equal(recording.resting(stated, positions, 1e-3), stated)
    np.testing.assert_array_equal(recording.resting(0 * stated, positions, 1e-3), [[0.0, 10.0, 0.0]])


@pytest.mark.parametrize("way", ["keep", "bake", "auto"])
def test_nothing_is_said_of_what_the_targets_own_motion_does(tmp_path, capsys, way):
    """Of a target only its body is used, so that its motion needs no choice."""
    path, target = swaying(tmp_path / "a.bvh"), swaying(tmp_path / "target.bvh", sway=3 * SWAY)
    arguments = ["retarget", f"{path}[unit=m,inner_positions={way}]", "-m", "copy_rotations"]
    arguments += ["--target", f"{target}[unit=m]", "-o", str(tmp_path / "b.bvh")]
    with pytest.raises(SystemExit) as stop:
        cli.main(arguments)
    output = capsys.readouterr()
    assert not stop.value.code, output
    assert "target.bvh: 'Spine1'" not in output.err
    assert ("a.bvh: 'Spine1' moves" in output.err) == (way == "auto")
    with pytest.raises(SystemExit):
        cli.main(["doctor", f"{target}[unit=m]"])
    assert "say inner_positions=" in capsys.readouterr().out, "where it is asked for, it is told"


def test_the_folder_data_set_says_once_for_each_body_what_it_drops(tmp_path):
    for name in ("b", "c"):
        (tmp_path / name).mkdir()
        for clip in ("one", "two"):
            swaying(tmp_path / name / f"{clip}.bvh", sway=SWAY * (name == "b"))
    folder = Folder(str(tmp_path), unit="m")
    notes = [note for note in folder.notes if "against its parent" in note]
    assert len(notes) == 1
    assert notes[0].startswith(
        "b, one.bvh: 'Spine1' moves by up to 0.04 m against its parent (1 joint does)"
    )
    assert notes[0].endswith("(inner_positions=bake fits rotations to that)")
    assert notes[0] in Folder(str(tmp_path), unit="m", protocol="train").training_notes
    for way in ("drop", "bake"):
        assert not [n for n in Folder(str(tmp_path), unit="m", inner_positions=way).notes if "parent" in n]
