"""Damaged files of every format: a motion of finite numbers, or one sentence that names the file."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import fbx_files
import gltf_files
import numpy as np
import pytest
import smpl_files
from hypothesis import given
from hypothesis import strategies as st
from test_acclaim import AMC, ASF
from test_bvh_faults import GOOD

from retarget_bench.errors import BenchError
from retarget_bench.motion import importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.files.smpl import skeletons
from retarget_bench.motion.files.smpl.skeletons import BODY
from retarget_bench.motion.motion import Motion, PointSets
from retarget_bench.motion.scans import load_scan
from retarget_bench.motion.scans.writing import ply
from tests.examples import examples

pytestmark = pytest.mark.usefixtures("forked")
ODD = [b"nan", b"-1", b"1e300", b"99999999999", b"{", b"}", b"[]", b"null", b"\n", b"\0", b'"', b"\xff" * 4]
"""What breaks texts and whole numbers."""


def _random() -> np.random.Generator:
    return np.random.default_rng(1)


def _joints() -> np.ndarray:
    return smpl_files.danced(Character.of("body", skeletons.average(BODY)), 5)


def _acclaim(folder: Path) -> None:
    (folder / "a.asf").write_text(ASF)
    (folder / "a.amc").write_text(AMC)


def _modelled(folder: Path) -> None:
    smpl_files.archive(folder / "a.npz", smpl_files.parameters(_random(), frames=4))
    smpl_files.archive(folder / "m.npz", smpl_files.model(_random()))


def _tetrahedron(folder: Path) -> None:
    corners = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    (folder / "a.ply").write_bytes(ply(corners, faces))


WRITERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "BVH": ("a.bvh", lambda folder: (folder / "a.bvh").write_bytes(GOOD)),
    "ASF": ("a.asf", _acclaim),
    "AMC": ("a.amc", _acclaim),
    "glb": ("a.glb", lambda folder: gltf_files.person(_random(), frames=4).save(folder / "a.glb")),
    "glTF": ("a.gltf", lambda folder: gltf_files.person(_random(), frames=4).save(folder / "a.gltf")),
    "FBX": ("a.fbx", lambda folder: fbx_files.person(_random(), frames=3).save(folder / "a.fbx")),
    "FBX, ASCII": (
        "a.fbx",
        lambda folder: fbx_files.person(_random(), frames=3).save(folder / "a.fbx", ascii=True),
    ),
    "AMASS": ("a.npz", _modelled),
    "body model": ("m.npz", _modelled),
    "joints": ("a.npy", lambda folder: np.save(folder / "a.npy", _joints())),
    "features": (
        "a.npy",
        lambda folder: np.save(folder / "a.npy", smpl_files.features(_joints(), np.zeros(5))),
    ),
    "PLY": ("a.ply", _tetrahedron),
}
"""Format -> the file that is damaged, and what writes it with all that it needs."""


def sound(kind: str, folder: Path) -> Path:
    """A file of the format, not damaged yet."""
    if kind.startswith("FBX"):
        pytest.importorskip("ufbx")
    if kind == "PLY":
        pytest.importorskip("trimesh")
    name, write = WRITERS[kind]
    write(folder)
    return folder / name


def load(kind: str, path: Path) -> Motion | PointSets:
    if kind == "PLY":
        return load_scan(path).motion
    if kind == "ASF":
        return importer.load(path.with_suffix(".amc")).motion
    if kind == "body model":
        return importer.load(path.with_name("a.npz"), Reading(body_model=path)).motion
    return importer.load(path).motion


@st.composite
def damages(draw: st.DrawFn, content: bytes) -> bytes:
    """Pieces removed, exchanged or put in, near the ends as often as elsewhere; or the end cut off."""
    data = bytearray(content)
    if draw(st.integers(0, 4)) == 0:
        return content[: draw(st.integers(0, len(content) - 1))]
    last = len(content) - 1
    places = st.integers(0, last) | st.integers(0, min(200, last)) | st.integers(max(0, last - 200), last)
    for _ in range(draw(st.integers(1, 3))):
        at, start = draw(places), draw(st.integers(0, last))
        piece = draw(
            st.sampled_from([*ODD, content[start : start + 8]]) | st.binary(min_size=1, max_size=4)
        )
        end = at + (len(piece) if draw(st.booleans()) else draw(st.integers(0, 9)))
        data[at:end] = piece
    return bytes(data)


@pytest.mark.parametrize("kind", WRITERS)
@examples(25)
@given(data=st.data())
def test_any_damage_is_read_or_refused_in_a_sentence(
    tmp_path_factory: pytest.TempPathFactory, kind: str, data: st.DataObject
) -> None:
    path = sound(kind, tmp_path_factory.mktemp("damaged"))
    path.write_bytes(data.draw(damages(path.read_bytes())))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            motion = load(kind, path)
            mesh = motion.character.mesh  # read when it is asked for
    except BenchError as error:
        message = str(error)
        assert "\n" not in message
        assert len(message) < 1000
        assert path.parent.name in message
        return
    for points in motion.points if isinstance(motion, PointSets) else [motion.positions]:
        assert np.isfinite(points).all()
    if mesh is not None:
        assert np.isfinite(mesh.vertices).all()
        assert np.isfinite(mesh.weights).all()


@pytest.mark.parametrize("kind", ["BVH", "glb", "FBX", "AMASS", "joints", "PLY"])
def test_a_file_that_is_cut_off_is_refused(tmp_path: Path, kind: str) -> None:
    path = sound(kind, tmp_path)
    content = path.read_bytes()
    for size in np.linspace(4, 0.9 * len(content), 25).astype(int):
        path.write_bytes(content[:size])
        with pytest.raises(BenchError) as error:
            load(kind, path)
        assert str(path) in str(error.value)
