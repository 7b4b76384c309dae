"""Meshes in files: formats, sequences, unit and up axis, and a sentence for whatever is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from retarget_bench.errors import BenchError, FileError, NotSupported
from retarget_bench.motion import rotation
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.scans import load_body, load_scan, write_frames
from retarget_bench.motion.scans.reading import files_of, frames_of, is_scan
from retarget_bench.motion.scans.writing import ply
from retarget_bench.motion.up_axis import UP_AXES
from retarget_bench.plugins import registry

trimesh = pytest.importorskip("trimesh")


@pytest.fixture(scope="module")
def walk() -> Motion:
    data = registry.create("datasets", "puppets[size=tiny]")
    return data.load(data.cases("retarget", "self")[0]).source.at(slice(0, 12, 3))


@pytest.fixture(scope="module")
def mesh(walk) -> Mesh:
    return walk.character.mesh


def written(path: Path, vertices: np.ndarray, faces: np.ndarray) -> Path:
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    return path


def off_surface(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> float:
    """Metres: the farthest that a point is from a surface, by trimesh."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    return float(trimesh.proximity.closest_point_naive(mesh, points[::100].astype(float))[1].max())


# ---------------------------------------------------------------------------------------------- formats
@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb", ".stl", ".off"])
def test_every_format_gives_the_same_points_and_body(tmp_path, mesh, suffix):
    path = written(tmp_path / f"ada{suffix}", mesh.vertices, mesh.faces)
    scan = load_scan(path)
    assert (scan.motion.frames, scan.motion.fps, scan.motion.character.name) == (1, 30.0, "ada")
    assert scan.findings.notes == ()
    assert off_surface(scan.motion.points[0], mesh.vertices, mesh.faces) < 1e-5
    body = load_body(path).character
    assert body.name == "ada"
    assert body.height == pytest.approx(np.ptp(mesh.vertices[:, 1]), abs=1e-5)
    corners = body.mesh.vertices[body.mesh.faces]
    np.testing.assert_allclose(corners, mesh.vertices[mesh.faces], atol=1e-5)
    if suffix != ".stl":
        np.testing.assert_allclose(body.mesh.vertices, mesh.vertices, atol=1e-5)
    moved = body.surface(body.mesh.vertices[None] + (0.0, 1.0, 0.0), 30.0)
    np.testing.assert_allclose(moved.positions[0, 0], (0.0, 1.0, 0.0), atol=1e-9)


def test_a_folder_is_sorted_by_its_numbers(tmp_path, walk, mesh):
    skin = mesh.skinned(walk)
    for number, frame in zip((10, 2, 1, 33), skin[[2, 1, 0, 3]], strict=True):
        written(tmp_path / f"f{number}.ply", frame, mesh.faces)
    (tmp_path / "notes.txt").write_text("not a mesh")
    scan = load_scan(tmp_path, fps=24.0)
    assert scan.findings.frames == ("f1", "f2", "f10", "f33")
    assert (scan.motion.frames, scan.motion.fps) == (4, 24.0)
    for points, frame in zip(scan.motion.points, skin, strict=True):
        assert off_surface(points, frame, mesh.faces) < 1e-5


def test_meshes_numbered_in_one_file_are_a_sequence_and_others_parts(tmp_path, mesh):
    scene = trimesh.Scene()
    for number in (2, 10, 1):
        moved = trimesh.Trimesh(
            mesh.vertices + np.array([0.0, 0.0, 0.01 * number]), mesh.faces, process=False
        )
        scene.add_geometry(moved, node_name=f"frame{number}", geom_name=f"frame{number}")
    scene.export(tmp_path / "many.glb")
    frames = list(frames_of(tmp_path / "many.glb"))
    assert [frame.name for frame in frames] == ["frame1", "frame2", "frame10"]
    assert load_scan(tmp_path / "many.glb").motion.frames == 3
    with pytest.raises(FileError, match="holds 3 frames; a target is one mesh"):
        load_body(tmp_path / "many.glb")
    dressed = trimesh.Scene()
    dressed.add_geometry(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False), node_name="skin")
    hat = trimesh.creation.box((0.2, 0.1, 0.2))
    hat.apply_translation((0.0, float(mesh.vertices[:, 1].max()), 0.0))
    dressed.add_geometry(hat, node_name="hat")
    dressed.export(tmp_path / "dressed.glb")
    body = load_body(tmp_path / "dressed.glb")
    assert body.findings.notes == ("the mesh has 2 parts that are not connected",)
    assert len(body.character.mesh.vertices) == len(mesh.vertices) + 8


def test_written_frames_are_read_again(tmp_path, walk, mesh):
    skin = mesh.skinned(walk)
    write_frames(tmp_path / "out", skin, mesh.faces, ["a1", "a2", "a3", "a10"])
    assert [path.name for path in files_of(tmp_path / "out")] == ["a1.ply", "a2.ply", "a3.ply", "a10.ply"]
    for frame, expected in zip(frames_of(tmp_path / "out"), skin, strict=True):
        assert np.array_equal(frame.vertices, expected.astype(np.float32))
        assert np.array_equal(frame.faces, mesh.faces)
    with pytest.raises(FileError, match="is there"):
        write_frames(tmp_path / "out", skin, mesh.faces)
    write_frames(tmp_path / "numbered", skin, mesh.faces, ["same"] * 4)
    assert [path.name for path in sorted((tmp_path / "numbered").iterdir())][-1] == "0003.ply"
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError, match="cannot be written"):
        write_frames(tmp_path / "file" / "out", skin, mesh.faces)


# ------------------------------------------------------------------------------------------- unit and axis
@pytest.mark.parametrize("up", UP_AXES)
@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001)])
def test_unit_and_up_axis_are_found_in_a_t_pose(tmp_path, mesh, up, unit, scale):
    turn = rotation.to_matrix(rotation.from_rotation_vector(np.array(UP_AXES[up])))
    path = written(tmp_path / "body.ply", mesh.vertices @ turn / scale, mesh.faces)
    body = load_body(path)
    assert (body.findings.up, body.findings.unit) == (up, (unit, scale))
    np.testing.assert_allclose(body.character.mesh.vertices, mesh.vertices, atol=1e-5)
    assert body.findings.warnings == ()


def test_what_the_user_says_stands(tmp_path, mesh):
    path = written(tmp_path / "body.ply", mesh.vertices, mesh.faces)
    imported = load_body(path, Reading(unit="0.5", up="z"))
    np.testing.assert_allclose(
        imported.character.mesh.vertices, 0.5 * mesh.vertices[:, [0, 2, 1]] * (1, 1, -1), atol=1e-6
    )
    assert imported.findings.warnings == ()
    for wrong in ({"unit": "foot"}, {"unit": "-1"}, {"up": "w"}):
        with pytest.raises(NotSupported, match="is not known; it is auto"):
            load_scan(path, Reading(**wrong))


def test_a_doubtful_size_is_told(tmp_path, mesh):
    path = written(tmp_path / "body.ply", mesh.vertices * 0.2, mesh.faces)
    (warning,) = load_scan(path).findings.warnings
    assert "the unit is a guess: in m the body is" in warning


# ----------------------------------------------------------------------------------------------- bad input
def test_open_and_crooked_meshes_and_clouds_are_told(tmp_path, mesh):
    holed = written(tmp_path / "open.ply", mesh.vertices, mesh.faces[5:])
    for loaded in (load_scan(holed), load_body(holed)):
        (note,) = loaded.findings.notes
        assert note.startswith("the mesh is open: ")
    a, b = mesh.faces[0, :2]
    fin = np.concatenate([mesh.vertices, mesh.vertices[a : a + 1] + 0.05])
    finned = written(tmp_path / "fin.ply", fin, np.vstack([mesh.faces, [a, b, len(mesh.vertices)]]))
    notes = load_scan(finned).findings.notes
    assert notes == (
        "the mesh is open: 2 edges have a face on one side only",
        "the mesh is not a manifold: 1 edges have more than two faces",
    )
    cloud = tmp_path / "cloud.ply"
    cloud.write_bytes(ply(mesh.vertices, np.zeros((0, 3))))
    scan = load_scan(cloud)
    assert "has no faces" in scan.findings.notes[0]
    near = np.abs(scan.motion.points[0][:20, None] - mesh.vertices).max(axis=2).min(axis=1)
    assert near.max() < 1e-6
    with pytest.raises(FileError, match=r"cloud\.ply: has no faces; a target needs a surface"):
        load_body(cloud)


def test_frames_may_differ_and_what_is_told_is_told_once(tmp_path, mesh):
    for number in range(3):
        (tmp_path / f"{number}.ply").write_bytes(ply(mesh.vertices, mesh.faces[number:]))
    coarse = trimesh.creation.capsule(0.7, 0.3).apply_translation((0, 0, 0.5))
    written(tmp_path / "3.ply", coarse.vertices[:, [1, 2, 0]], coarse.faces)
    (note,) = load_scan(tmp_path, Reading(up="y", unit="m")).findings.notes
    assert (
        note == "the mesh of 2 of 4 frames is open: 3 edges have a face on one side only, the first being 1"
    )


def _with(vertices: np.ndarray, index: int, value: float) -> np.ndarray:
    changed = vertices.copy()
    changed[index, 1] = value
    return changed


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_vertices_that_are_not_finite_are_refused(tmp_path, mesh, value):
    (tmp_path / "bad.ply").write_bytes(ply(_with(mesh.vertices, 7, value), mesh.faces))
    for load in (load_scan, load_body):
        with pytest.raises(
            FileError, match=r"bad\.ply: has 1 vertices that are not finite, the first being 7"
        ):
            load(tmp_path / "bad.ply")


def test_a_mesh_that_lies_in_one_plane_but_for_rounding_is_refused_in_a_sentence(tmp_path):
    """One vertex lies so far away that all faces are in the plane of a floor: nothing would be left."""
    vertices = np.array(
        [[0, 0, 0], [1, 3.602879701896397e16, 1.3032075718220799e-43], [0, 1, 0], [0, 0, 1]]
    )
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    (tmp_path / "far.ply").write_bytes(ply(vertices, faces))
    for load in (load_scan, load_body):
        with pytest.raises(FileError, match=r"far\.ply: has faces without area only"):
            load(tmp_path / "far.ply")


def joined(*meshes: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of several meshes in one."""
    before = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    faces = [each + first for (_, each), first in zip(meshes, before[:-1], strict=True)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces)


@pytest.mark.parametrize(
    "beside",
    [pytest.param(1.4, id="apart"), pytest.param(1.0, id="touching"), pytest.param(0.92, id="overlapping")],
)
def test_two_bodies_are_refused_whether_their_hands_touch_or_not(tmp_path, mesh, beside):
    """beside: widths of the body from one to the other."""
    shift = np.array([beside * np.ptp(mesh.vertices[:, 0]), 0.0, 0.05])
    two = joined((mesh.vertices, mesh.faces), (mesh.vertices + shift, mesh.faces))
    path = written(tmp_path / "two.obj", *two)
    for load in (load_scan, load_body):
        with pytest.raises(FileError, match=r"two\.obj: holds two bodies beside each other.*of its own"):
            load(path)
    (tmp_path / "two.ply").write_bytes(ply(two[0], np.zeros((0, 3))))
    with pytest.raises(FileError, match="holds two bodies"):
        load_scan(tmp_path / "two.ply")


@pytest.mark.slow
def test_a_single_body_in_motion_is_not_two(tmp_path):
    data = registry.create("datasets", "puppets[size=tiny]")
    infos = {info.clip.partition("-")[0]: info for info in data.cases("retarget", "self")}
    assert len(infos) > 3
    for name, info in infos.items():
        motion = data.load(info).source
        low = int(motion.root[:, 1].argmin())  # sitting, bent or lying
        body = motion.character.mesh
        path = tmp_path / f"{name}.ply"
        path.write_bytes(ply(body.skinned(motion.at(slice(low, low + 1)))[0], body.faces))
        assert load_scan(path).findings.notes == ()


FLOOR = np.array([[-2.0, 0, -2.0], [2.0, 0, -2.0], [2.0, 0, 2.0], [-2.0, 0, 2.0]])
QUAD = np.array([[0, 2, 1], [0, 3, 2]])


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("plane", ["floor", "wall"])
def test_a_floor_or_a_wall_is_left_out_and_told(tmp_path, mesh, plane, up):
    flat = FLOOR + np.array([0.0, mesh.vertices[:, 1].min(), 0.0])
    if plane == "wall":
        flat = FLOOR[:, [0, 2, 1]] + [0.0, 0.9, mesh.vertices[:, 2].min() - 0.3]
    vertices, faces = joined((mesh.vertices, mesh.faces), (flat, QUAD))
    if up == "z":
        vertices = vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    body = load_body(written(tmp_path / "room.ply", vertices, faces))
    assert body.findings.up == up
    assert body.findings.notes == ("the mesh has a floor or a wall, which is left out: 2 faces",)
    np.testing.assert_allclose(body.character.mesh.vertices, mesh.vertices, atol=1e-5)
    np.testing.assert_array_equal(body.character.mesh.faces, mesh.faces)
    scan = load_scan(tmp_path / "room.ply")
    assert np.ptp(scan.motion.points[0][:, 1]) == pytest.approx(np.ptp(mesh.vertices[:, 1]), rel=0.02)


def test_stray_points_of_a_cloud_are_left_out_and_told(tmp_path, mesh):
    numbers = np.random.default_rng(0)
    points = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).sample(4000, seed=0)
    stray = numbers.uniform(-1.0, 1.0, (20, 3)) * 4.0
    away = np.linalg.norm(stray[:, None] - points[::20], axis=2).min(axis=1) > 0.5
    (tmp_path / "cloud.ply").write_bytes(ply(np.concatenate([points, stray[away]]), np.zeros((0, 3))))
    scan = load_scan(tmp_path / "cloud.ply")
    assert scan.findings.up == "y"
    assert scan.findings.height == pytest.approx(np.ptp(points[:, 1]), rel=0.02)
    told = f"has loose parts far from the body, which are left out: {away.sum()} vertices"
    assert f"the mesh {told}" in scan.findings.notes


def test_small_parts_far_away_are_left_out_and_near_ones_kept(tmp_path, mesh):
    ball = trimesh.creation.icosphere(1, 0.1)
    near = ball.vertices + np.array([0.0, mesh.vertices[:, 1].max() + 0.1, 0.0])  # hair, a hat
    far = ball.vertices + np.array([1.8, 2.5, 0.5])
    vertices, faces = joined((mesh.vertices, mesh.faces), (near, ball.faces), (far, ball.faces))
    body = load_body(written(tmp_path / "body.ply", vertices, faces))
    count = len(mesh.vertices) + len(near)
    np.testing.assert_allclose(body.character.mesh.vertices, vertices[:count], atol=1e-5)
    assert body.findings.notes == (
        f"the mesh has loose parts far from the body, which are left out: {len(far)} vertices",
        "the mesh has 2 parts that are not connected",
    )


@pytest.mark.parametrize(
    ("axis", "sign", "share"), [(1, 1, 0.55), (1, -1, 0.55), (1, 1, 0.45), (0, 1, 0.5), (2, 1, 0.5)]
)
def test_a_body_of_which_half_is_missing_is_told(tmp_path, mesh, axis, sign, share):
    """Its lower or upper half, cut at the waist or through both thighs, one side, or its back."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    away = mesh.vertices - (low + share * (high - low))
    kept = (sign * away[mesh.faces][:, :, axis] > 0).all(axis=1)
    path = written(tmp_path / "half.ply", mesh.vertices, mesh.faces[kept])
    for load in (load_scan, load_body):
        first, *_ = load(path).findings.notes
        assert first.startswith("the mesh lacks a part of the body, such as its half or its back")


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("a.ply", b"", "is empty"),
        ("a.ply", b"\x1f\x8b\x08\0\0", "is not PLY but gzip-compressed: unpack it first"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 2\n", "cannot be read as a mesh|holds no mesh"),
        ("a.glb", b"glTF\x02\x00\x00\x00", "cannot be read as a mesh"),
        ("a.obj", b"# nothing\n", "holds no mesh|cannot be read as a mesh"),
        ("a.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 9\n", "faces with other indices|cannot be read"),
        ("a.ply", ply(np.zeros((4, 3)), np.array([[0, 1, 2]])), "has all its vertices in one place"),
        ("a.ply", ply(np.eye(3), np.array([[0, 1, 1]])), "has faces without area only"),
        ("a.txt", b"hello", "is no mesh file"),
    ],
)
def test_what_is_no_mesh_gets_a_sentence(tmp_path, name, content, why):
    (tmp_path / name).write_bytes(content)
    for load in (load_scan, load_body):
        with pytest.raises(BenchError, match=why) as error:
            load(tmp_path / name)
        assert str(error.value).startswith(str(tmp_path / name))


def test_folders_without_frames_or_with_several_formats_are_refused(tmp_path, mesh):
    with pytest.raises(FileError, match="has no frames"):
        load_scan(tmp_path)
    written(tmp_path / "1.ply", mesh.vertices, mesh.faces)
    written(tmp_path / "2.off", mesh.vertices, mesh.faces)
    with pytest.raises(FileError, match=r"several formats \(\.off, \.ply\)"):
        load_scan(tmp_path)
    with pytest.raises(FileError, match="is a folder; a target is one mesh file"):
        load_body(tmp_path)
    with pytest.raises(FileError, match="is not there"):
        load_scan(tmp_path / "none.ply")
    assert is_scan(tmp_path)
    assert not is_scan(tmp_path / "clip.bvh")
    assert not is_scan(tmp_path / "rigged.glb")
