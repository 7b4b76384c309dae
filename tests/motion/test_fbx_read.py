"""FBX files against matrices by the formula of FBX: skeletons, motion, skins, units, axes and takes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import fbx_files
import numpy as np
import pytest
from fbx_files import Joint, Made, Skin, dress, person, pivots, skinned, world

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion import files, importer, kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.recording import Recording

pytest.importorskip("ufbx")
pytestmark = pytest.mark.usefixtures("forked")
FLAT = np.array([-1.0, 1.0, 1.0])


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(5)


def agrees(
    recording: Recording,
    scene: Made,
    take: str | None = "act",
    *,
    start: float = 0.0,
    scale: float = 1.0,
    mirror: np.ndarray | float = 1.0,
) -> None:
    """Joints and vertices stand where the formula has them, in every frame."""
    order = [[joint.name for joint in scene.joints].index(name) for name in recording.skeleton.names]
    places = kinematics.forward(recording.skeleton, recording.rotations, recording.root)[0]
    moving = Character.of("body", recording.skeleton).motion(
        recording.rotations, recording.root, recording.fps
    )
    points = recording.skin().skinned(moving) if recording.skin else None
    for frame in range(len(places)):
        standing = world(scene, take, start + frame / recording.fps)
        expected = pivots(scene, standing)[order] * scale * mirror
        np.testing.assert_allclose(places[frame], expected, atol=1e-5 * scale)
        if points is not None and scene.skins:
            expected = skinned(scene.skins[0], standing) * scale * mirror
            np.testing.assert_allclose(points[frame], expected, atol=1e-5 * scale)


# --------------------------------------------------------------------------------------------- content
@pytest.mark.parametrize(
    "kind",
    [
        {},
        {"version": 7500},
        {"version": 7100, "packed": False},
        {"ascii": True},
        {"version": 7700, "ascii": True},
    ],
)
def test_binary_and_ascii_files_of_all_versions(tmp_path, random, kind):
    figure = person(random)
    recording = files.read(figure.save(tmp_path / "one.fbx", **kind))
    assert (len(recording.skeleton), len(recording.root), recording.fps) == (16, 12, 30.0)
    assert (recording.unit, recording.up, recording.doubts) == ("cm", "y", ())
    assert recording.skin is not None
    assert recording.skin().faces.shape == (7, 3)
    agrees(recording, figure)


def test_post_rotations_pivots_and_nodes_above(tmp_path, random):
    turned = np.array([-90.0, 0.0, 20.0])
    above = (
        Joint("scene", kind="Null", scaling=np.full(3, 2.0), translation=np.array([3.0, 0.0, -7.0])),
        Joint("Armature", 0, kind="Null", rotation=turned, scaling=np.full(3, 0.5)),
    )
    figure = person(random, above=above, skin=False)
    for joint in figure.joints[2:]:
        joint.post, joint.pivot = random.uniform(-90, 90, 3), random.normal(scale=5, size=3)
    fbx_files.stand_up(figure, 2, 100.0)
    dress(figure, random, 2)
    recording = files.read(figure.save(tmp_path / "one.fbx"))
    assert recording.skeleton.names[0] == "Hips"
    agrees(recording, figure)


def test_joints_that_do_not_inherit_their_parents_scale(tmp_path, random):
    figure = person(random, skin=False)
    figure.joints[0].scaling, figure.joints[1].scaling = np.full(3, 1.5), np.full(3, 1.25)
    for joint in figure.joints:
        joint.inherit = 2
    dress(figure, random, 0)
    agrees(files.read(figure.save(tmp_path / "one.fbx")), figure)


def test_the_skeleton_stands_as_its_skin_was_bound(tmp_path, random):
    figure = person(random)
    bound = world(figure)[:16, :3, 3]
    for joint in figure.joints[:16]:
        joint.rotation = joint.rotation + random.uniform(-40, 40, 3)  # a frame of some take
    recording = files.read(figure.save(tmp_path / "one.fbx"))
    away = recording.skeleton.rest_positions - recording.skeleton.offsets[0]
    order = [[joint.name for joint in figure.joints].index(name) for name in recording.skeleton.names]
    np.testing.assert_allclose(away, bound[order] - bound[0], atol=1e-6)
    agrees(recording, figure)


def test_a_mesh_that_hangs_on_a_joint(tmp_path, random):
    figure = person(random, skin=False)
    head = [joint.name for joint in figure.joints].index("Head")
    figure.joints.append(
        Joint("hat", head, np.array([0.0, 12.0, 3.0]), np.array([10.0, 20.0, 30.0]), kind="Mesh")
    )
    hat = random.normal(scale=10, size=(5, 3))
    figure.skins.append(Skin(len(figure.joints) - 1, hat, [[0, 1, 2, 3, 4]], np.zeros((5, 0)), [], {}))
    recording = files.read(figure.save(tmp_path / "one.fbx"))
    mesh = recording.skin()
    assert set(np.unique(mesh.weights[:, recording.skeleton.index("Head")])) == {1.0}
    moving = Character.of("body", recording.skeleton).motion(recording.rotations, recording.root, 30.0)
    for frame in (0, 7):
        at = world(figure, "act", frame / 30)[-1]
        expected = hat @ at[:3, :3].T + at[:3, 3]
        np.testing.assert_allclose(mesh.skinned(moving)[frame], expected, atol=1e-5)


def test_nodes_that_are_no_bones(tmp_path, random):
    figure = person(random)
    for joint in figure.joints[:16]:
        joint.kind = "Null"
    recording = files.read(figure.save(tmp_path / "one.fbx"))
    assert len(recording.skeleton) == 16
    agrees(recording, figure)
    figure.skins.clear()
    figure.joints.pop()
    agrees(files.read(figure.save(tmp_path / "one.fbx")), figure)


# ---------------------------------------------------------------------------------------- unit and axes
@pytest.mark.parametrize(
    ("centimetres", "unit", "scale"),
    [
        (1.0, "cm", 1),
        (100.0, "m", 1),
        (0.1, "mm", 1),
        (2.54, "inch", 1),
        (10.0, "dm", 1),
        (30.48, "m", 0.3048),
    ],
)
def test_units(tmp_path, random, centimetres, unit, scale):
    figure = replace(person(random, size=100 / centimetres), centimetres=centimetres)
    path = figure.save(tmp_path / "one.fbx")
    recording = files.read(path)
    assert recording.unit == unit
    agrees(recording, figure, scale=scale)
    imported = importer.load(path)
    assert imported.findings.unit[0] == unit
    assert "as stated" in imported.findings.text()
    assert imported.motion.character.height == pytest.approx(1.5818, abs=1e-4)


@pytest.mark.parametrize(("axes", "up"), [((2, 1, 1, -1, 0, 1), "z"), ((0, 1, 1, 1, 2, 1), "x")])
def test_up_axes(tmp_path, random, axes, up):
    figure = replace(person(random), axes=axes)
    recording = files.read(figure.save(tmp_path / "one.fbx"))
    assert recording.up == up
    agrees(recording, figure)


def test_left_handed_axes_are_mirrored(tmp_path, random):
    figure = replace(person(random), axes=(1, 1, 2, -1, 0, 1))
    recording = files.read(figure.save(tmp_path / "one.fbx"))
    agrees(recording, figure, mirror=FLAT)
    upright = files.read(replace(figure, axes=(1, 1, 2, 1, 0, 1)).save(tmp_path / "other.fbx"))
    corners, others = (each.skin().vertices[each.skin().faces] for each in (recording, upright))
    volume, other = (np.linalg.det(each).sum() for each in (corners, others))
    assert volume == pytest.approx(other)  # seen from outside, faces turn the same way


# --------------------------------------------------------------------------------------- takes and rate
def test_the_first_take_that_moves_and_another(tmp_path, random):
    figure = person(random, frames=6)
    act = figure.takes["act"]
    figure.takes = {
        "still": {key: (times[:1], values[:1]) for key, (times, values) in act.items()},
        "act": act,
        "nod": {key: (times, values[::-1]) for key, (times, values) in act.items()},
    }
    path = figure.save(tmp_path / "one.fbx")
    assert files.takes(path) == ("still", "act", "nod")
    agrees(files.read(path), figure, "act")
    agrees(files.read(path, Reading(take="3")), figure, "nod")


def test_a_file_without_takes_is_a_pose(tmp_path, random):
    figure = person(random)
    figure.takes.clear()
    recording = files.read(figure.save(tmp_path / "one.fbx"))
    assert len(recording.root) == 1
    assert "no take moves the body: one frame, the pose at rest" in recording.notes
    agrees(recording, figure, None)


@pytest.mark.parametrize("fps", [24.0, 25.0, 60.0, 120.0, 59.94, 12.5])
def test_frames_at_the_rate_of_the_file(tmp_path, random, fps):
    figure = person(random, fps=fps)
    recording = files.read(figure.save(tmp_path / "one.fbx"))
    assert (recording.fps, len(recording.root)) == (pytest.approx(fps), 12)
    agrees(recording, figure)


def test_a_rate_that_is_too_low_or_missing(tmp_path, random):
    figure = person(random, fps=60.0)
    slow = replace(figure, mode=6)
    recording = files.read(slow.save(tmp_path / "one.fbx"))
    assert (recording.fps, len(recording.root)) == (30.0, 6)
    assert recording.doubts[-1].startswith("its keys are 60 per second, and the file says 30:")
    agrees(recording, figure)
    recording = files.read(replace(figure, mode=0).save(tmp_path / "one.fbx"))
    assert (recording.fps, len(recording.root)) == (pytest.approx(60.0), 12)


def test_a_take_has_its_own_range_and_steps_are_reached(tmp_path, random):
    figure = person(random, frames=10)
    figure.constant = True
    figure.ranges["act"] = (3 / 30, 7 / 30)
    recording = files.read(figure.save(tmp_path / "one.fbx"))
    assert len(recording.root) == 5
    agrees(recording, figure, start=3 / 30)
    figure.ranges["act"] = (50.0, 60.0)  # without any key in it
    assert len(files.read(figure.save(tmp_path / "one.fbx")).root) == 10


def test_joints_that_move_against_their_parents(tmp_path, random):
    figure = person(random, skin=False)
    times, _ = figure.takes["act"][0, "T"]
    hand = [joint.name for joint in figure.joints].index("LeftHand")
    steps = np.linspace(0, 7, len(times))[:, None] * np.array([1.0, 0.0, 0.0])
    figure.takes["act"][hand, "T"] = times, figure.joints[hand].translation + steps
    recording = files.read(figure.save(tmp_path / "one.fbx"))
    joint = recording.skeleton.index("LeftHand")
    away = np.linalg.norm(recording.places[:, joint] - recording.places[:1, joint], axis=-1)
    np.testing.assert_allclose(away, steps[:, 0], atol=1e-4)
    path = tmp_path / "one.fbx"
    assert any("LeftHand" in warning for warning in importer.load(path).findings.warnings)
    turned = kinematics.forward(recording.skeleton, recording.rotations, recording.root)[1]
    parent = recording.skeleton.parents[joint]
    above = [each.name for each in figure.joints].index(recording.skeleton.names[parent])
    for frame in (0, 5):
        standing = world(figure, "act", frame / 30)
        step = rotation.rotate(turned[frame, parent], recording.places[frame, joint])
        np.testing.assert_allclose(step, standing[hand, :3, 3] - standing[above, :3, 3], atol=1e-5)


# ------------------------------------------------------------------------------------------------ bodies
def test_several_bodies(tmp_path, random):
    one, other = person(random, skin=False), person(random, skin=False)
    first = len(one.joints)
    other.joints = [replace(each, name=f"b:{each.name}") for each in other.joints]
    for joint in other.joints:
        joint.parent = joint.parent + first if joint.parent >= 0 else -1
    other.joints[-1] = replace(other.joints[-1], translation=other.joints[-1].translation + 1)
    curves = {(joint + first, path): curve for (joint, path), curve in other.takes["act"].items()}
    scene = Made([*one.joints, *other.joints, Joint("b:tail", first)], {"act": one.takes["act"] | curves})
    path = scene.save(tmp_path / "two.fbx")
    recording = files.read(path)
    assert "body 2 of 2, 'b:Hips'" in recording.notes[0]
    agrees(recording, scene)
    agrees(files.read(path, Reading(body="Hips")), scene)
    with pytest.raises(NotSupported, match="no body 'c'; it has 1 'Hips', 2 'b:Hips'"):
        files.read(path, Reading(body="c"))


# --------------------------------------------------------------------------------- beside other formats
@pytest.mark.parametrize(
    "content", [b"; FBX 6.1.0 project file", b"Kaydara FBX Binary  \0\x1a\0" + bytes(9)]
)
def test_without_ufbx_one_sentence_tells_how_to_get_it(tmp_path, monkeypatch, content):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    (tmp_path / "one.fbx").write_bytes(content)
    with pytest.raises(NotSupported, match=r"needs ufbx: pip install 'retarget-bench\[fbx\]'"):
        files.read(tmp_path / "one.fbx")


# ---------------------------------------------------------------------------------------------- damage
@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"", "is empty"),
        (b"not an fbx file at all", "is not FBX but text of an unknown kind"),
        (b"Kaydara FBX Binary  \0\x1a\0", "is cut off"),
        (
            b"Kaydara FBX Binary  \0\x1a\0\xe8\x1c\0\0" + bytes(400),
            "holds no skeleton: neither a skin nor a take",
        ),
        (b"; FBX 7.4.0 project file\n", "is cut off"),
        (b"glTF" + bytes(9), "is cut off after 13 bytes"),
    ],
)
def test_what_holds_no_motion(tmp_path, data, sentence):
    (tmp_path / "odd.fbx").write_bytes(data)
    with pytest.raises(FileError, match=sentence) as error:
        files.read(tmp_path / "odd.fbx")
    assert "\n" not in str(error.value)


@pytest.mark.processes
def test_a_crash_is_a_sentence_and_nothing_is_left(tmp_path, random, monkeypatch):
    path = person(random, frames=3).save(tmp_path / "odd.fbx")
    crashing = tmp_path / "crash.py"
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    for does, sentence in (
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", r"crashes ufbx \(-11\)"),
        ("raise RuntimeError('out of order')", "process that reads it failed .*out of order"),
        ("pass", "wrote nothing"),
        ("import time; time.sleep(60)", "took more than 0.8 s to read"),
    ):
        crashing.write_text(does)
        monkeypatch.setattr("retarget_bench.motion.files.fbx.child.__file__", str(crashing))
        if "sleep" in does:
            monkeypatch.setattr("retarget_bench.motion.files.fbx.content._SECONDS", 0.2)
        with pytest.raises(FileError, match=sentence):
            files.read(path)
    assert not list(scratch.iterdir())


def test_a_take_without_end_and_numbers_beyond_all_bodies(tmp_path, random):
    figure = person(random, frames=4, skin=False)
    figure.ranges["act"] = (0.0, 1e8)
    with pytest.raises(FileError, match="has a take that lasts 1e\\+08 s"):
        files.read(figure.save(tmp_path / "odd.fbx"))
    figure = person(random, frames=4, skin=False)
    figure.joints[4].translation = np.array([np.nan, 0, 0])
    with pytest.raises(FileError, match="places that are no numbers"):
        files.read(figure.save(tmp_path / "odd.fbx"))


@pytest.mark.processes
def test_it_works_from_a_path_of_any_name(tmp_path, random):
    folder = tmp_path / "ein Ordner – 一"
    folder.mkdir()
    path = person(random, frames=3).save(folder / "böse 'name'.fbx")
    assert len(files.read(path).root) == 3
    assert isinstance(importer.load(Path(path)).motion.frames, int)
