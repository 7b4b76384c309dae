"""Damaged and hostile .npz and .npy files: one sentence each that names the file, and nothing else."""

from __future__ import annotations

import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest
from refusal import told
from smpl_files import archive, parameters

from retarget_bench.errors import BenchError
from retarget_bench.motion import files, importer
from retarget_bench.motion.files.reading import Reading


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            {"poses": None},
            "is no AMASS file: it has neither poses nor root_orient and pose_body, but trans",
        ),
        (
            {"poses": np.zeros((12, 150))},
            "has 'poses' of shape (12, 150); known are (frames, n) with n = 66",
        ),
        ({"poses": np.zeros(156)}, "has 'poses' of shape (156,)"),
        ({"poses": np.zeros((0, 156))}, "has no frames"),
        ({"poses": np.full((12, 156), np.inf)}, "'poses' holds NaN or infinity, first in row 1"),
        ({"poses": np.full((12, 156), 1e5)}, "'poses' with numbers above 1000"),
        ({"poses": np.zeros((12, 156), complex)}, "'poses' holds complex128, and numbers are needed"),
        ({"poses": np.full((12, 156), None)}, "'poses' is a pickled object, which is never loaded"),
        ({"poses": np.ones((12, 52, 3, 3))}, "has 'poses' with matrices that are no rotations"),
        ({"poses": np.tile(-np.eye(3), (12, 52, 1, 1))}, "has 'poses' with matrices that are no rotations"),
        ({"poses": np.zeros((12, 51, 3, 3))}, "has 'poses' of shape (12, 459); known are"),
        (
            {"trans": None, "smpl_trans": np.zeros((12, 3)), "smpl_scaling": np.zeros(1)},
            "has 'smpl_scaling' that is no size of a body",
        ),
        ({"trans": np.zeros((11, 3))}, "has 'trans' of shape (11, 3); (12, 3) is needed"),
        ({"trans": np.full((12, 3), np.nan)}, "'trans' holds NaN or infinity"),
        ({"trans": np.full((12, 3), 1e300)}, "'trans' with numbers above 1e+09"),
        ({"betas": np.zeros((3, 10))}, "has 'betas' of shape (3, 10)"),
        ({"betas": np.full(10, 1e200)}, "'betas' with numbers above"),
        ({"mocap_framerate": np.array(np.nan)}, "'mocap_framerate' holds NaN"),
        ({"mocap_framerate": np.array(-30)}, "'mocap_framerate' = -30, which is no frame rate"),
        ({"mocap_framerate": np.array([30, 30])}, "'mocap_framerate' = (2,), which is no frame rate"),
        ({"mocap_framerate": np.array("fast")}, "'mocap_framerate' holds str128"),
    ],
)
def test_what_is_wrong_with_an_archive_is_said(tmp_path, change, sentence):
    content = parameters(np.random.default_rng(1)) | change
    path = archive(tmp_path / "odd.npz", {name: each for name, each in content.items() if each is not None})
    assert sentence in told(path)


def test_parts_of_poses_that_do_not_fit_each_other(tmp_path):
    content = parameters(np.random.default_rng(1))
    del content["poses"]
    parts = {"root_orient": np.zeros((12, 3)), "pose_body": np.zeros((11, 63))}
    assert "'root_orient' (12, 3), 'pose_body' (11, 63)" in told(
        archive(tmp_path / "a.npz", content | parts)
    )
    odd = parts | {"pose_body": np.zeros((12, 63)), "pose_hand": np.zeros(12)}
    assert "'pose_body' (12, 63), 'pose_hand' (12,)" in told(archive(tmp_path / "c.npz", content | odd))
    parts["pose_body"] = np.zeros((12, 60))
    assert "root, body and hands together of shape (12, 63)" in told(
        archive(tmp_path / "b.npz", content | parts)
    )


def test_whatever_is_doubtful_in_an_archive_is_said_and_read(tmp_path):
    content = parameters(np.random.default_rng(1))
    del content["trans"]
    content |= {
        "poses": np.degrees(content["poses"]),
        "gender": np.array([{}]),
        "betas": np.arange(24).reshape(12, 2),
    }
    recording = files.read(archive(tmp_path / "a.npz", content))
    text = " / ".join((*recording.notes, *recording.doubts))
    for part in (
        "states no 'trans'",
        "are they degrees?",
        "no gender that is known",
        "betas change from frame",
    ):
        assert part in text


@pytest.mark.parametrize(
    ("array", "sentence"),
    [
        (
            np.zeros((3, 21, 3)),
            "is of shape (3, 21, 3); joint positions of the SMPL family are (frames, 22, 3)",
        ),
        (np.zeros((3, 251)), "features of HumanML3D (frames, 263)"),
        (np.zeros(263), "is of shape (263,)"),
        (np.zeros(()), "has no frames"),
        (np.zeros((0, 22, 3)), "has no frames"),
        (np.zeros((2, 22, 3)), "has all joints in one place"),
        (np.full((2, 22, 3), np.nan), "holds NaN or infinity, first in row 1"),
        (np.full((2, 22, 3), 1e200), "holds numbers above 1e+09"),
        (np.full((2, 22, 3), "a"), "holds str32, and numbers are needed"),
        (np.array({"motion": 1}), "is a pickled object, which is never loaded"),
    ],
)
def test_what_is_wrong_with_a_joint_array_is_said(tmp_path, array, sentence):
    np.save(tmp_path / "odd.npy", array)
    assert sentence in told(tmp_path / "odd.npy")


class Opened:
    def __reduce__(self):
        return (Path.touch, (Path("unpickled"),))


def test_nothing_is_ever_unpickled(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    odd = np.empty(1, object)
    odd[0] = Opened()
    content = parameters(np.random.default_rng(1))
    for name in ("poses", "gender", "betas", "surface_model_type"):
        archive(tmp_path / "odd.npz", content | {name: odd})
        importer_said(tmp_path / "odd.npz")
    np.save(tmp_path / "odd.npy", odd)
    told(tmp_path / "odd.npy")
    (tmp_path / "raw.npy").write_bytes(pickle.dumps(odd))
    told(tmp_path / "raw.npy")
    assert not (tmp_path / "unpickled").exists()


def importer_said(path: Path, model: Path | None = None) -> str:
    """The sentence about a file, "" where it is read; whatever else is raised."""
    sentence = ""
    try:
        motion = importer.load(path, Reading(body_model=model)).motion
        assert np.isfinite(motion.positions).all()
        assert model is None or np.isfinite(motion.character.mesh.vertices).all()
    except BenchError as error:
        sentence = str(error)
    assert "\n" not in sentence
    assert len(sentence) < 1000
    return sentence


def with_header(shape: str, descr: str = "'<f8'") -> bytes:
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text


@pytest.mark.parametrize(
    ("header", "sentence"),
    [
        (with_header("(1000000000, 156)"), "too large to be a motion"),
        (with_header("(12, 156)"), "does not fit its size"),
        (with_header("(-1, 156)"), "is of shape (-1, 156)"),
        (with_header("(True, 156)"), ""),
        (with_header("'a'"), "is damaged or cut off"),
        (with_header("(1,)", "'|O'"), "is a pickled object"),
        (with_header("(1,)", "[" * 3000), "is damaged or cut off"),
        (b"\x93NUMPY\x09\x09" + bytes(50), "is damaged or cut off"),
        (b"\x93NUMPY\x01\x00\xff\xff{", "is damaged or cut off"),
    ],
)
@pytest.mark.parametrize("packed", [True, False])
def test_headers_that_lie(tmp_path, header, sentence, packed):
    if packed:
        path = tmp_path / "odd.npz"
        with zipfile.ZipFile(path, "w") as file:
            file.writestr("poses.npy", header)
    else:
        path = tmp_path / "odd.npy"
        path.write_bytes(header)
    assert sentence in told(path)


def test_bombs_and_odd_zips(tmp_path):
    path = tmp_path / "odd.npz"
    big = with_header("(60000000, 1)") + bytes(8 * 60_000)
    for method, sentence in (
        (zipfile.ZIP_DEFLATED, "does not fit its size"),
        (zipfile.ZIP_LZMA, "is packed in a way"),
    ):
        with zipfile.ZipFile(path, "w", method) as file:
            file.writestr("poses.npy", big)
        assert sentence in told(path)
    with zipfile.ZipFile(
        path, "w", zipfile.ZIP_DEFLATED
    ) as file:  # zeros, a thousand times their packed size
        file.writestr("poses.npy", with_header("(3355443, 156)") + bytes(1 << 26))
    assert "too large to be a motion" in told(path)
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("walk.txt", "x")
    assert "is not NPZ but a zip archive" in told(path)
    (tmp_path / "odd.bvh").write_bytes(path.read_bytes())
    assert "unpack it first" in told(tmp_path / "odd.bvh")
    assert told(tmp_path / "gone.npz").startswith("cannot be read")
