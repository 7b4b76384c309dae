"""``bench retarget`` on scans: a folder of meshes or points in, a folder of the target's mesh out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import retarget_bench as rb
from retarget_bench.errors import BenchError
from retarget_bench.motion.scans.writing import ply, write_frames
from retarget_bench.plugins import registry
from tests.motion.tubes import fleshed, hand_to_belly

trimesh = pytest.importorskip("trimesh")

METHOD = '''
import numpy as np
from retarget_bench.api import MethodCard

class Follow:
    """The target's mesh goes where the middle of the points goes."""

    card = MethodCard(name="follow", summary="follows", version="1", accepts=("points",))

    def supports(self, source, target):
        return None if target.mesh is not None else "needs a mesh"

    def retarget(self, source, target, *, context):
        way = source.root - source.root[0]
        return target.surface(target.mesh.vertices + way[:, None], source.fps)

plugin = Follow
'''
JOINTS = METHOD.replace("follow", "joints").replace(
    "target.surface(target.mesh.vertices + way[:, None], source.fps)",
    "target.positions(np.zeros((source.frames, len(target.skeleton), 3)), source.fps)",
)
FRAMES = 12


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_FILES", {})


@pytest.fixture
def files(tmp_path) -> Path:
    """A walk of 12 frames in centimetres with Z up, and a larger body as OBJ; methods that take points."""
    person = fleshed()
    moved = hand_to_belly(person, FRAMES)
    way = np.linspace(0, 0.6, FRAMES)[:, None, None] * np.array([0.0, 0.0, 1.0])
    walk = person.mesh.skinned(moved) + way
    lying = 100.0 * walk @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # y is z now, z is -y
    write_frames(tmp_path / "walk", lying, person.mesh.faces, [f"scan{k}" for k in range(FRAMES)])
    trimesh.Trimesh(1.2 * person.mesh.vertices, person.mesh.faces, process=False).export("body.obj")
    for name, text in (("follow", METHOD), ("joints", JOINTS)):
        (tmp_path / f"{name}.py").write_text(text)
        registry.add_file(tmp_path / f"{name}.py")
    return tmp_path


def seen(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices ``(frames, V, 3)`` and faces of a folder, by another reader."""
    meshes = [trimesh.load(each, process=False) for each in sorted(folder.iterdir(), key=order)]
    return np.stack([each.vertices for each in meshes]), np.asarray(meshes[0].faces)


def order(path: Path) -> int:
    return int("".join(sign for sign in path.stem if sign.isdigit()))


def test_the_targets_mesh_moves_in_metres_y_up(bench, files):
    result = bench("retarget", "walk", "--target", "body.obj", "-o", "out", "-m", "follow", "--fps", "25")
    assert result[0] == 0, result[2]
    assert result[1].count("\n") == 1
    for phrase in (
        "12 frames of walk at 25 per second",
        "mesh of body.obj",
        "unit cm, z up",
        "unit m, y up",
    ):
        assert phrase in result[1]
    vertices, faces = seen(files / "out")
    person = fleshed()
    np.testing.assert_array_equal(faces, person.mesh.faces)
    assert sorted(each.name for each in (files / "out").iterdir()) == sorted(
        f"scan{k}.ply" for k in range(FRAMES)
    )
    shifts = vertices - 1.2 * person.mesh.vertices
    np.testing.assert_allclose(shifts, shifts[:, :1].repeat(shifts.shape[1], 1), atol=1e-4)  # rigid
    assert shifts[-1, 0, 2] == pytest.approx(0.6, abs=0.05)  # forward, in metres
    assert abs(shifts[-1, 0, :2]).max() < 0.05


def test_points_without_faces_move_it_alike(bench, files):
    (files / "dots").mkdir()
    for number, each in enumerate(seen(files / "walk")[0]):
        (files / "dots" / f"{number}.ply").write_bytes(ply(each, np.zeros((0, 3), dtype=int)))
    assert bench("retarget", "dots", "--target", "body.obj", "-o", "a", "-m", "follow")[0] == 0
    assert bench("retarget", "walk", "--target", "body.obj", "-o", "b", "-m", "follow", "--quiet") == (
        0,
        "",
        "",
    )
    apart = seen(files / "a")[0] - seen(files / "b")[0]
    assert np.abs(apart).max() < 0.12  # the middle of vertices is not that of the surface


def test_python_gives_what_the_command_writes(bench, files):
    person = fleshed()
    (files / "open.ply").write_bytes(ply(person.mesh.vertices, person.mesh.faces[1:]))
    result = bench("retarget", "walk", "--target", "open.ply", "-o", "out", "-m", "follow")
    assert result[0] == 0
    assert "open.ply: the mesh is open: 3 edges" in result[2]
    with pytest.warns(UserWarning, match="open.ply: the mesh is open: 3 edges"):
        surface = rb.retarget_scans("walk", "open.ply", "follow")
    assert repr(surface).startswith("<Surface of open: 12 frames")
    np.testing.assert_allclose(surface.vertices, seen(files / "out")[0], atol=1e-6)
    assert surface.save("again") == Path("again")
    names = sorted(each.name for each in (files / "out").iterdir())
    assert all(
        (files / "again" / each).read_bytes() == (files / "out" / each).read_bytes() for each in names
    )
    with pytest.raises(BenchError, match="is there"):
        surface.save("again")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("walk", "--target", "me.bvh", "-o", "out"), "me.bvh: is no mesh file"),
        (("walk.bvh", "--target", "body.obj", "-o", "out"), "without a rig"),
        (("walk", "--target", "body.obj", "-o", "out.bvh"), "folder of .ply files"),
        (("walk[roles=r.toml]", "--target", "body.obj", "-o", "out"), "r.toml: cannot be read"),
        (("walk", "--target", "body.obj", "-o", "out", "--start", "cut"), "no joints"),
        (("walk[unit=ell]", "--target", "body.obj", "-o", "out"), "unit='ell' is not known"),
        (("walk", "--target", "body.obj", "-o", "out", "-m", "copy_rotations"), "gave no motion"),
        (("walk", "--target", "body.obj", "-o", "out", "-m", "joints"), "joints alone"),
        (("walk", "--target", "broken.ply", "-o", "out"), "cannot be read as a mesh"),
    ],
)
def test_what_cannot_be_is_a_sentence_and_leaves_nothing(bench, files, arguments, message):
    import re

    (files / "broken.ply").write_text("hello")
    before = sorted(each.name for each in files.iterdir())
    code, out, error = bench("retarget", *arguments, *(() if "-m" in arguments else ("-m", "follow")))
    assert code == 2, out
    assert re.search(message, error), error
    assert "Traceback" not in error
    assert sorted(each.name for each in files.iterdir()) == before


def test_a_command_that_is_killed_leaves_nothing_half_written(bench, files, monkeypatch):
    from retarget_bench.motion.scans import writing

    original = writing.ply
    count = iter(range(5))

    def failing(*arguments):
        if next(count) == 4:
            raise KeyboardInterrupt
        return original(*arguments)

    monkeypatch.setattr(writing, "ply", failing)
    before = {each.name for each in files.iterdir()}
    assert bench("retarget", "walk", "--target", "body.obj", "-o", "out", "-m", "follow")[0] != 0
    assert {each.name for each in files.iterdir()} == before
    monkeypatch.setattr(writing, "ply", original)
    assert bench("retarget", "walk", "--target", "body.obj", "-o", "out", "-m", "follow")[0] == 0
    assert len(list((files / "out").iterdir())) == FRAMES
