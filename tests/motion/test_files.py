"""The table of file formats: files are read by what they hold, and every format goes one way."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from gltf_files import person

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion import bvh, files, importer
from retarget_bench.motion.file_kinds import kind_of
from retarget_bench.motion.files import formats
from retarget_bench.motion.files.catalogue import motion_files, motions_of
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.files.scenes.bodies import chosen


@pytest.fixture
def glb(tmp_path) -> Path:
    figure = person(np.random.default_rng(2), frames=6)
    figure.animate("wave/left", {(5, "rotation"): ([0.0, 0.5], [[0, 0, 0, 1], [0, 1, 0, 0]])})
    return figure.save(tmp_path / "a.glb")


@pytest.fixture
def text(tmp_path, glb) -> Path:
    bvh.write(tmp_path / "a.bvh", importer.load(glb).motion)
    return tmp_path / "a.bvh"


def test_the_content_decides_and_the_ending_where_there_is_none(tmp_path, glb, text):
    assert files.format_of(glb) is formats.GLTF
    assert files.format_of(text) is formats.BVH
    for file, other in ((glb, ".bvh"), (glb, ".dat"), (text, ".glb"), (text, "")):
        misnamed = tmp_path / f"misnamed{other}"
        misnamed.write_bytes(file.read_bytes())
        assert files.format_of(misnamed) is files.format_of(file)
        loaded, expected = (
            importer.load(misnamed, Reading(unit="m")).motion,
            importer.load(file, Reading(unit="m")).motion,
        )
        np.testing.assert_array_equal(loaded.rotations, expected.rotations)
    assert files.format_of("gone.gltf") is formats.GLTF
    assert files.format_of("gone") is formats.BVH


def test_every_format_has_endings_of_its_own_and_one_that_is_written():
    endings = [ending for form in files.FORMATS for ending in form.suffixes]
    assert len(set(endings)) == len(endings)
    assert all(each.startswith(".") and each == each.lower() for each in endings)
    assert set(files.suffixes(written=True)) <= set(files.suffixes())
    assert files.suffixes(written=True) == (".bvh", ".glb", ".npz")


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.c3d", b"\x02P\0\0", "a C3D file of marker positions, .* export it as BVH, FBX or GLB"),
        ("a.TRC", b"PathFileType\t4\t(X/Y/Z)\ta.trc\n", "a TRC file of marker positions"),
        ("a.vmd", b"Vocaloid Motion Data 0002\0\0", "a motion of MikuMikuDance: import it with its model"),
        ("a.pkl", b"\x80\x04\x95", "a pickle of Python, .* never loaded: save its arrays as .npz"),
        ("a.pt", b"PK\x03\x04" + bytes(26) + b"a/data.pkl", "a file of PyTorch, which .* is never loaded"),
        ("a.pkl", b"version https://git-lfs.github.com/spec/v1\n", "a Git LFS pointer: run `git lfs pull`"),
        ("a.fbx", b"version https://git-lfs.github.com/spec/v1\n", "a Git LFS pointer: run `git lfs pull`"),
        ("a.glb", b"\n<!DOCTYPE html>\n", "is a web page"),
        ("a.glb", b"404: Not Found", "is a web page"),
        ("a.fbx", b"\x1f\x8b\x08\0\0", "is not FBX but gzip-compressed: unpack it first"),
        ("a.glb", b"BLENDER-v293", "not glTF but a Blender scene: export it as BVH, FBX or GLB"),
        ("a.amc", b"PK\x03\x04" + bytes(30), "a zip archive: unpack it first"),
        ("a.npy", b"\x89HDF\r\n", "not NPY but an HDF5 file"),
        ("a.npy", b"<HTML>", "is a web page"),
        ("a.asf", b"/annex/objects/MD5E-s9--00.asf\n", "is a git-annex pointer: run `git annex get`"),
    ],
)  # fmt: skip
def test_what_is_no_file_of_motion_is_named(tmp_path, name, data, words):
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(FileError, match=words):
        importer.load(path)
    assert motions_of(path) == {"a": path}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b" \r\n", "empty"),
        (b"; FBX 7.4.0 project file\n; ---", "an ASCII FBX file"),
        (b"Kaydara FBX Binary  \0\x1a\0", "a binary FBX file"),
        (b"glTF\2\0\0\0", "a binary glTF file"),
        (b'\xef\xbb\xbf {"asset": {}}', "a JSON file"),
        (b"PK\x05\x06" + bytes(18), "a zip archive"),
        (b"# AST/ASF file generated\n:version 1.10\n:hierarchy\n", "an Acclaim skeleton (ASF)"),
        (b"#!OML:ASF a\n:FULLY-SPECIFIED\n:DEGREES\n1\n", "an Acclaim motion (AMC)"),
        (b"# made by hand\r\n  hierarchy\r\nROOT a", "a BVH file"),
        (b"HIERARCHY ROOT a {", "a BVH file"),
        ("HIERARCHY".encode("utf-16"), "UTF-16 text"),
        (b"(dp0\nS'betas'\n", "a pickle of Python"),
        (bytes(range(256)) * 40, "binary data of an unknown kind"),
        (b"A hierarchy of joints\n", "text of an unknown kind"),
    ],
)  # fmt: skip
def test_kinds_of_files(tmp_path, data, words):
    (tmp_path / "a").write_bytes(data)
    assert kind_of(tmp_path / "a").words == words


def test_arrays_of_numpy_and_tensors_of_torch_are_told_from_other_archives(tmp_path):
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", poses=np.zeros(3))
        assert kind_of(tmp_path / "a.npz").name == "NPZ"
    np.savez(tmp_path / "a.npz")
    assert kind_of(tmp_path / "a.npz").words == "a zip archive"
    with zipfile.ZipFile(tmp_path / "a.pt", "w") as file:
        file.writestr("a/data.pkl", b"\x80\x02}q")
    assert kind_of(tmp_path / "a.pt").words == "a file of PyTorch"


def test_a_motion_under_the_name_of_another_format_is_read(tmp_path, text):
    misnamed = tmp_path / "misnamed.c3d"
    misnamed.write_bytes(text.read_bytes())
    assert files.format_of(misnamed) is formats.BVH


def test_options_of_one_format_are_refused_by_another(glb, text):
    with pytest.raises(NotSupported, match="holds one motion of one body: leave out take='2'"):
        files.read(text, Reading(take="2"))
    with pytest.raises(NotSupported, match="root_place='relative' is for BVH files"):
        files.read(glb, Reading(root_place="relative"))


def test_one_of_several_by_name_or_number():
    names = ["Walk", "2", "", "walk"]
    assert [chosen(each, names, "animation", Path("a")) for each in ("walk", "WALK", "2", "4", "1")] == [
        3, 0, 1, 3, 0
    ]  # fmt: skip
    for choice in ("5", "0", "-1", "run", "9" * 400):
        with pytest.raises(NotSupported, match="it has 1 'Walk', 2 '2', 3 '', 4 'walk'"):
            chosen(choice, names, "animation", Path("a"))


def test_the_motions_of_a_folder_have_names_of_their_own(tmp_path, glb, text):
    (tmp_path / ".hidden.bvh").write_text("")
    (tmp_path / "note.txt").write_text("")
    (tmp_path / "broken.glb").write_bytes(b"glTF")
    named_files = motion_files(tmp_path)
    assert list(named_files) == ["a", "a-act", "a-wave_left", "broken"]
    assert named_files["a"] == text
    assert named_files["a-wave_left"] == tmp_path / "a.glb#2"
    assert len(importer.load(named_files["a-wave_left"]).motion.root) == 16
    single = person(np.random.default_rng(2), frames=6).save(tmp_path / "b.glb")
    assert motions_of(single) == {"b": single}
    (tmp_path / "b.bvh").write_bytes(text.read_bytes())
    assert {"b", "b.glb"} <= set(motion_files(tmp_path))
