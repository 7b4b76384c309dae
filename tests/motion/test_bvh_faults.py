"""Files that are no BVH, or damaged: one clear error with file and line, in bounded time and memory."""

from __future__ import annotations

import os
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from retarget_bench.errors import FileError
from retarget_bench.motion import bvh
from tests.examples import examples

GOOD = b"""HIERARCHY
ROOT Hips
{
	OFFSET 0 90 0
	CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
	JOINT Spine
	{
		OFFSET 0 10 0
		CHANNELS 3 Zrotation Xrotation Yrotation
		End Site
		{
			OFFSET 0 2 0
		}
	}
}
MOTION
Frames: 3
Frame Time: 0.033333
1 2 3 4 5 6 7 8 9
1.5 2 3 4 5 6 7 8 9
2 2 3 4 5 6 7 8 9.25
"""


def refusal(folder: Path, data: bytes) -> FileError:
    """The error that the file gives."""
    path = folder / "clip (1).bvh"
    path.write_bytes(data)
    with pytest.raises(FileError) as caught:
        bvh.read(path)
    assert str(caught.value).startswith(f"{path}:")
    assert "\n" not in str(caught.value)
    return caught.value


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is empty"),
        (b" \r\n\t\n", "only blanks"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n", "git lfs pull"),
        (b"/annex/objects/MD5E-s9--00.bvh\n", "git annex get"),
        (b"Kaydara FBX Binary  \x00\x1a\x00" + bytes(500), "binary FBX"),
        (b"; FBX 7.4.0 project file\n; ---", "ASCII FBX"),
        (b"glTF\x02\x00\x00\x00", "glTF"),
        (b"PK\x03\x04\x14\x00", "zip archive"),
        (b"\x1f\x8b\x08\x00", "gzip"),
        (b"<!DOCTYPE html>\n<html>", "web page"),
        (b'{"asset": {}}', "JSON"),
        (b"# AST/ASF file generated\n:version 1.10\n", "Acclaim skeleton"),
        (b":FULLY-SPECIFIED\n:DEGREES\n1\n", "Acclaim motion"),
        (GOOD.decode().encode("utf-16"), "UTF-16"),
        (bytes(range(256)) * 40, "binary data"),
        (b"ROOT Hips\n{\n", "instead of HIERARCHY"),
        (b"HIERARCHY\n\x00\x00\x00", "not a line of a BVH hierarchy"),
    ],
)
def test_what_is_no_bvh_is_named(tmp_path: Path, data: bytes, words: str) -> None:
    error = refusal(tmp_path, data)
    assert words in error.problem


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="No such file"):
        bvh.read(tmp_path / "none.bvh")
    os.mkfifo(tmp_path / "pipe.bvh")
    with pytest.raises(FileError, match="no ordinary file"):
        bvh.read(tmp_path / "pipe.bvh")
    with pytest.raises(FileError, match="is a folder"):
        bvh.read(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        (b"JOINT Spine", b"JOINT", 6, "JOINT without a name"),
        (b"JOINT Spine", b"JOINT Hips", 6, "cyclic"),
        (b"JOINT Spine", b"ROOT Spine", 6, "second ROOT"),
        (b"JOINT Spine", b"BONE Spine", 6, "'BONE Spine' is not a line"),
        (b"ROOT Hips", b"JOINT Hips", 2, "outside of the ROOT"),
        (b"OFFSET 0 10 0", b"OFFSET 0 10", 8, "three finite numbers"),
        (b"JOINT Spine", b"JOINT Sp\0ine", 6, "cannot be printed"),
        (b"OFFSET 0 10 0", b"OFFSET 0 10 nan", 8, "three finite numbers"),
        (b"OFFSET 0 10 0", b"OFFSET 0 1_0 0", 8, "three finite numbers"),
        (b"\t\tOFFSET 0 10 0\n", b"", 13, "JOINT 'Spine', begun in line 6, has no OFFSET"),
        (b"\t\tOFFSET 0 10 0\n", b"\t\tOFFSET 0 1 0\n\t\tOFFSET 0 1 0\n", 9, "second one"),
        (b"CHANNELS 3", b"CHANNELS 4", 9, "CHANNELS says 4, but 3 names follow"),
        (b"CHANNELS 3", b"CHANNELS", 9, "CHANNELS says"),
        (b"3 Zrotation Xrotation", b"3 Zrotation Zrotation", 9, "named twice"),
        (b"3 Zrotation Xrotation", b"3 Zrotation Xscale", 9, "'Xscale' is not one of"),
        (b"JOINT Spine\n\t{", b"JOINT Spine\n", 8, "expected '{' after JOINT 'Spine'"),
        (b"}\nMOTION", b"MOTION", 15, "cut off: ROOT 'Hips', begun in line 2"),
        (b"}\nMOTION", b"}\n}\nMOTION", 16, "'}' without a '{'"),
        (b"MOTION\n", b"", 16, "not a line"),
        (b"Frames: 3", b"Frames: three", 17, "a whole number, found 'Frames: three'"),
        (b"Frames: 3", b"Frames: -3", 17, "a whole number"),
        (b"Frames: 3", b"Frames: 0", 17, "says 0"),
        (b"Frames: 3", b"Frames: " + b"9" * 9000, 17, "a whole number"),
        (b"Frame Time: 0.033333", b"Frame Time: 0", 18, "seconds above 0"),
        (b"Frame Time: 0.033333", b"Frame Time: inf", 18, "seconds above 0"),
        (b"Frame Time: 0.033333\n", b"", 18, "'Frame Time:'"),
        (b"Frames: 3", b"Frames: 4", 21, "says 4, but only 3 follow"),
        (b"Frames: 3", b"Frames: 10000000", 21, "says 10000000, but only 3 follow"),
        (b"Frames: 3", b"Frames: 2", 21, "says 2, but 3 follow"),
        (b"1.5 2 3", b"1.5 2", 20, "frame 2 has 8 of 9 numbers"),
        (b"1.5 2 3", b"1.5 2 3 3", 20, "frame 2 has 10 of 9 numbers"),
        (b"1.5 2 3", b"nan 2 3", 20, "frame 2 has 'nan' as number 1"),
        (b"1.5 2 3", b"1.5 -inf 3", 20, "'-inf' as number 2"),
        (b"1.5 2 3", b"1.5 2 1e999", 20, "'1e999' as number 3"),
        (b"1.5 2 3", b"1,5 2 3", 20, "'1,5' as number 1"),
        (b"1.5 2 3", b"1.5 \"2\" 3", 20, "as number 2"),
        (b"1.5 2 3", b"1.5 2\x00 3", 20, "as number 2"),
        (b"1.5 2 3", b"1.5 2 0x3", 20, "'0x3' as number 3"),
        (b" 8 9.25\n", b"", 21, "frame 3 has 7 of 9 numbers: the file is cut off"),
    ],
)  # fmt: skip
def test_damage_is_found_with_its_line(
    tmp_path: Path, old: bytes, new: bytes, line: int, words: str
) -> None:
    assert GOOD.count(old) >= 1
    error = refusal(tmp_path, GOOD.replace(old, new, 1))
    assert words in error.problem
    assert error.line == line


def test_no_channels_at_all(tmp_path: Path) -> None:
    text = b"HIERARCHY\nROOT A\n{\nOFFSET 0 0 0\n}\nMOTION\nFrames: 1\nFrame Time: 1\n"
    assert "no joint has channels" in refusal(tmp_path, text).problem


def test_cut_anywhere_it_is_an_error_or_the_whole(tmp_path: Path) -> None:
    path = tmp_path / "cut.bvh"
    whole = bvh.parse(_save(path, GOOD)).values
    for length in range(len(GOOD)):
        path.write_bytes(GOOD[:length])
        try:
            values = bvh.parse(path, cache=False).values
        except FileError:
            continue
        # only a cut within the very last number cannot be seen
        assert length >= GOOD.rindex(b" ") + 2
        np.testing.assert_array_equal(values.ravel()[:-1], whole.ravel()[:-1])


@examples(100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_random_damage_never_gives_anything_but_a_file_error(tmp_path: Path, data: st.DataObject) -> None:
    text = bytearray(GOOD)
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(text)))
        length = data.draw(st.integers(0, 30))
        piece = data.draw(
            st.one_of(
                st.binary(max_size=12),
                st.sampled_from(
                    [b"{", b"}", b"\n", b"nan", b"-", b"1e9", b"JOINT x", b"End Site", b"MOTION\n", b"\t"]
                ),
                st.integers(0, len(GOOD) - 40).map(lambda start: GOOD[start : start + 40]),
            )
        )
        text[at : at + length] = piece
    path = _save(tmp_path / "fuzz.bvh", bytes(text))
    try:
        recording = bvh.read(path)
    except FileError:
        return
    assert np.isfinite(recording.rotations).all()
    assert np.isfinite(recording.root).all()
    assert recording.rotations.shape[1] == len(recording.skeleton)


@examples(80, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    data=st.one_of(st.binary(max_size=300), st.binary(max_size=300).map(lambda tail: b"HIERARCHY\n" + tail))
)
def test_any_bytes_are_refused(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(FileError):
        bvh.read(_save(tmp_path / "any.bvh", data))


WORST = {
    "one endless line of numbers": GOOD[: GOOD.index(b"1 2 3")] + b"0 " * 1_000_000,
    "no numbers, many blank lines": GOOD[: GOOD.index(b"1 2 3")] + b"\n" * 500_000,
    "one number per line": GOOD[: GOOD.index(b"1 2 3")] + b"1\n" * 1_000_000,
    "blank lines for a hierarchy": b"HIERARCHY" + b"\n" * 500_000,
    "keywords without end": b"HIERARCHY\n" * 200_000,
    "joints without end": b"HIERARCHY\nROOT a\n{\n" + b"JOINT b{\nOFFSET 0 0 0\n}\n" * 80_000,
    "nested without end": b"HIERARCHY\nROOT a\n{\n" + b"".join(b"JOINT b%d{" % i for i in range(150_000)),
    "braces without end": b"HIERARCHY\nROOT a\n" + b"{" * 500_000,
    "an endless name": b"HIERARCHY\nROOT " + b"a" * 2_000_000,
    "channels without end": b"HIERARCHY\nROOT a\n{\nCHANNELS 9 " + b"Xposition " * 200_000,
}


@pytest.mark.parametrize("kind", WORST)
def test_time_and_memory_stay_bounded(tmp_path: Path, kind: str) -> None:
    path = _save(tmp_path / "worst.bvh", WORST[kind])
    tracemalloc.start()
    begun = time.process_time()
    try:
        with pytest.raises(FileError) as caught:
            bvh.read(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(str(caught.value)) < 300 + len(str(path))
    assert peak < 100 * len(WORST[kind])
    assert time.process_time() - begun < 60, "far beyond what it takes: only a runaway gets here"


def test_a_bad_file_of_a_good_size_is_left_unread(tmp_path: Path) -> None:
    path = tmp_path / "big.bvh"
    with path.open("wb") as file:
        file.write(b"Kaydara FBX Binary  \x00")
        file.truncate(1 << 33)  # 8 GB, sparse
    with pytest.raises(FileError, match="binary FBX"):
        bvh.read(path)


def _save(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def test_what_no_body_can_be_is_refused(tmp_path: Path) -> None:
    text = GOOD.replace(b"OFFSET 0 10 0", b"OFFSET 0 1e308 0")
    (tmp_path / "long.bvh").write_bytes(text)
    with pytest.raises(FileError, match="no body is that long"):
        bvh.read(tmp_path / "long.bvh")
    head = b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Yrotation\n"
    joints = b"".join(b"JOINT j%d\n{\nOFFSET 0 1 0\n}\n" % k for k in range(2_001))
    many = head + joints + b"}\nMOTION\nFrames: 1\nFrame Time: 1\n0\n"
    (tmp_path / "many.bvh").write_bytes(many)
    with pytest.raises(FileError, match="2002 joints"):
        bvh.read(tmp_path / "many.bvh")
