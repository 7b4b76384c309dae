"""Targets of the correspondence-free pipeline in other poses: brought into the T-pose or refused."""

from __future__ import annotations

import numpy as np
import pytest
import skr_material

import retarget_bench as rb
from retarget_bench import cli
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.correspondence_free import CorrespondenceFree
from retarget_bench.methods.correspondence_free.posing import into_t_pose
from retarget_bench.motion import rotation
from retarget_bench.motion.alignment import residuals
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.scans.writing import ply, write_frames
from retarget_bench.plugins import registry


@pytest.fixture(scope="module")
def networks():
    method = CorrespondenceFree()
    if reason := method.untrained:
        pytest.skip(reason)
    return method.networks


def posed(body: Character, turns: dict[str, tuple[float, float, float]]) -> np.ndarray:
    """Vertices of a body in T-pose with joints turned about the world's axes, in degrees."""
    pose, world = body.reference_pose.copy(), body.reference_globals
    for role, turn in turns.items():
        joint = body.joint_of[role]
        above = world[body.skeleton.parents[joint]]
        about = rotation.multiply(rotation.from_rotation_vector(np.radians(turn)), above)
        local = rotation.multiply(rotation.conjugate(above), about)
        pose[joint] = rotation.multiply(local, pose[joint])
    return body.mesh.skinned(body.motion(pose[None], body.skeleton.offsets[:1], 30.0))[0]


def lowered(body: Character, degrees: float) -> np.ndarray:
    return posed(body, {"left_arm": (0, 0, -degrees), "right_arm": (0, 0, degrees)})


def apart(one: np.ndarray, other: np.ndarray, body: Character) -> float:
    """Mean distance of vertices after the best rigid fit, as a share of the height."""
    return float(residuals(one[None], other[None])[0]) / body.height


def mid_walk() -> Motion:
    """The middle of a walk, arms hanging."""
    data = registry.create("datasets", "puppets")
    walks = (info for info in data.cases("retarget", "intra") if info.clip == "walk-001")
    motion = data.load(next(walks)).reference
    return motion.at(slice(motion.frames // 2, motion.frames // 2 + 1))


@pytest.mark.parametrize("name", skr_material.NAMES)
def test_a_t_pose_is_returned_as_it_is(networks, name):
    mesh = skr_material.body(name).mesh
    vertices, notes = into_t_pose(networks, mesh.vertices, mesh.faces)
    assert vertices is mesh.vertices
    assert notes == ()


@pytest.mark.parametrize("degrees", [20.0, 45.0, 75.0])
def test_lowered_arms_are_brought_into_the_t_pose(networks, degrees):
    body = skr_material.body()
    vertices = lowered(body, degrees)
    moved, (note,) = into_t_pose(networks, vertices, body.mesh.faces)
    assert apart(moved, body.mesh.vertices, body) < min(
        0.012, 0.5 * apart(vertices, body.mesh.vertices, body)
    )
    said = note.removeprefix("its mesh was brought into the T-pose: its arms are ")
    assert float(said.removesuffix(" degrees from straight out")) == pytest.approx(degrees, abs=6.0)


def test_where_the_target_stands_and_faces_makes_no_difference(networks):
    body = skr_material.body("boris")
    turn = rotation.to_matrix(rotation.from_rotation_vector(np.array([0.0, 2.0, 0.0])))
    vertices = lowered(body, 45.0) @ turn.T + [3.0, 0.0, -2.0]
    moved, _ = into_t_pose(networks, vertices, body.mesh.faces)
    assert apart(moved, body.mesh.vertices, body) < 0.012


def test_a_body_in_the_middle_of_a_step_is_brought_into_the_t_pose(networks):
    motion = mid_walk()
    body, vertices = motion.character, motion.character.mesh.skinned(motion)[0]
    moved, (note,) = into_t_pose(networks, vertices, body.mesh.faces)
    before = apart(vertices, body.mesh.vertices, body)
    assert apart(moved, body.mesh.vertices, body) < min(0.025, 0.4 * before)
    assert "degrees from straight out" in note


def test_a_pose_that_is_not_known_is_refused(networks):
    body = skr_material.body()
    folded = posed(body, {"spine_1": (110, 0, 0), "left_arm": (0, 80, 0), "right_up_leg": (-100, 0, 0)})
    with pytest.raises(NotSupported, match=r"do not fit it .*degrees.*give its mesh in a T-pose"):
        into_t_pose(networks, folded, body.mesh.faces)


# ------------------------------------------------------------------------------------------- the command
@pytest.fixture
def files(tmp_path, monkeypatch):
    """Scans of a walk, and another body with its arms out, lowered, and folded."""
    pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    motion, body = skr_material.motions()["ada"].at(slice(0, 12, 3)), skr_material.body("boris")
    write_frames(tmp_path / "scans", motion.character.mesh.skinned(motion), motion.character.mesh.faces)
    folded = posed(body, {"spine_1": (110, 0, 0), "left_arm": (0, 80, 0), "right_up_leg": (-100, 0, 0)})
    poses = {"t": body.mesh.vertices, "a": lowered(body, 45.0), "folded": folded}
    for name, vertices in poses.items():
        (tmp_path / f"{name}.ply").write_bytes(ply(vertices, body.mesh.faces))
    return tmp_path


def bench(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stop:
        cli.main(["retarget", *arguments])
    return int(stop.value.code or 0), *capsys.readouterr()


@pytest.mark.slow
def test_the_command_and_python_say_what_was_done_to_a_target(networks, files, capsys):
    assert "T-pose" not in "".join(bench(capsys, "scans", "--target", "t.ply", "-o", "t")[1:])
    code, _, error = bench(capsys, "scans", "--target", "a.ply", "-o", "a")
    assert code == 0
    assert "a.ply: its mesh was brought into the T-pose: its arms are 4" in error
    with pytest.warns(UserWarning, match=r"a\.ply: its mesh was brought into the T-pose"):
        surface = rb.retarget_scans("scans", "a.ply")
    assert [note.partition(":")[0] for note in surface.notes] == ["its mesh was brought into the T-pose"]
    expected = rb.retarget_scans("scans", "t.ply")
    assert expected.notes == ()
    rigid = float(residuals(surface.vertices, expected.vertices)[0])
    assert rigid < 0.02 * skr_material.body("boris").height


@pytest.mark.slow
def test_a_target_that_is_refused_leaves_nothing(networks, files, capsys):
    code, out, error = bench(capsys, "scans", "--target", "folded.ply[up=y,unit=m]", "-o", "out")
    assert (code, out) == (2, "")
    assert "give its mesh in a T-pose" in error
    assert not (files / "out").exists()
    with pytest.raises(BenchError, match="give its mesh in a T-pose"):
        rb.retarget_scans("scans", "folded.ply", target_up="y", target_unit="m")
