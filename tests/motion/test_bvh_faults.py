"""Files that are no BVH, or damaged: one clear error with file and line, in bounded time and memory."""

from __future__ import annotations

import time
import tracemalloc
from pathlib import Path

import pytest

from retarget_bench.errors import FileError
from retarget_bench.motion import bvh
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.files.writing import write
from retarget_bench.motion.importer import load

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
        (b" \r\n\t\n", "is empty"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n", "git lfs pull"),
        (
            b"Kaydara FBX Binary  \x00\x1a\x00" + bytes(500),
            "is not BVH but a binary FBX file: export it as",
        ),
        (b"ROOT Hips\n{\n", "instead of HIERARCHY"),
        (b"HIERARCHY\n\x00\x00\x00", "not a line of a BVH hierarchy"),
        (GOOD[: GOOD.index(b"MOTION")], "the line MOTION is missing"),
        (GOOD[: GOOD.index(b"Frames:")], "ends before the lines 'Frames:' and 'Frame Time:'"),
    ],
)
def test_what_is_no_bvh_is_named(tmp_path: Path, data: bytes, words: str) -> None:
    error = refusal(tmp_path, data)
    assert words in error.problem


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        (b"JOINT Spine", b"JOINT", 6, "JOINT without a name"),
        (b"JOINT Spine", b"JOINT Hips", 6, "cyclic"),
        (b"JOINT Spine", b"ROOT Spine", 6, "second ROOT"),
        (b"ROOT Hips", b"JOINT Hips", 2, "outside of the ROOT"),
        (b"JOINT Spine", b"JOINT Sp\0ine", 6, "cannot be printed"),
        (b"OFFSET 0 10 0", b"OFFSET 0 10 nan", 8, "three finite numbers"),
        (b"\t\tOFFSET 0 10 0\n", b"", 13, "JOINT 'Spine', begun in line 6, has no OFFSET"),
        (b"\t\tOFFSET 0 10 0\n", b"\t\tOFFSET 0 1 0\n\t\tOFFSET 0 1 0\n", 9, "second one"),
        (b"CHANNELS 3", b"CHANNELS 4", 9, "CHANNELS says 4, but 3 names follow"),
        (b"3 Zrotation Xrotation", b"3 Zrotation Zrotation", 9, "named twice"),
        (b"3 Zrotation Xrotation", b"3 Zrotation Xscale", 9, "'Xscale' is not one of"),
        (b"JOINT Spine\n\t{", b"JOINT Spine\n", 8, "expected '{' after JOINT 'Spine'"),
        (b"}\nMOTION", b"MOTION", 15, "cut off: ROOT 'Hips', begun in line 2"),
        (b"}\nMOTION", b"}\n}\nMOTION", 16, "'}' without a '{'"),
        (b"MOTION\n", b"", 16, "not a line"),
        (b"Frames: 3", b"Frames: three", 17, "a whole number, found 'Frames: three'"),
        (b"Frames: 3", b"Frames: 0", 17, "says 0"),
        (b"Frames: 3", b"Frames: " + b"9" * 9000, 17, "a whole number"),
        (b"Frame Time: 0.033333", b"Frame Time: -1", 18, "seconds above 0"),
        (b"Frame Time: 0.033333\n", b"", 18, "'Frame Time:'"),
        (b"Frames: 3", b"Frames: 4", 21, "says 4, but only 3 follow"),
        (b"Frames: 3", b"Frames: 2", 21, "says 2, but 3 follow"),
        (b"1.5 2 3", b"1.5 2", 20, "frame 2 has 8 of 9 numbers"),
        (b"1.5 2 3", b"1.5 2 3 3", 20, "frame 2 has 10 of 9 numbers"),
        (b"1.5 2 3", b"nan 2 3", 20, "frame 2 has 'nan' as number 1"),
        (b"1.5 2 3", b"1.5 2 1e999", 20, "'1e999' as number 3"),
        (b"1.5 2 3", b"1.5 2\x00 3", 20, "as number 2"),
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


NUMBERS = GOOD[GOOD.index(b"1 2 3") :]
COMMAS = GOOD.replace(b"OFFSET 0 10 0", b"OFFSET 0 10,5 0").replace(b"0.033333", b"0,033333")


@pytest.mark.parametrize(
    "text",
    [
        b"# made by hand\n// and again\n" + GOOD.replace(b"\tJOINT", b"; a remark, 1.5\n\tJOINT"),
        GOOD.replace(b"MOTION\n", b"# x\nMOTION\n# y\n").replace(b"1.5 2", b"# 0 0\n1.5 2"),
        GOOD.replace(NUMBERS, NUMBERS.replace(b"\n", b" ") + b"\n"),
        GOOD.replace(NUMBERS, NUMBERS.replace(b" ", b"\n")),
        GOOD.replace(NUMBERS, NUMBERS.replace(b" 5 6 ", b" 5\n\n6 ")),
        GOOD + b"\n  \n\x1a",
        GOOD.replace(b"\n", b"\r\n") + b"\x1a\x1a",
        GOOD.replace(b".", b","),
        GOOD.replace(b"0 10 0", b"0, 10, 0").replace(b"1.5 2 3", b"1.5, 2, 3,"),
        GOOD.replace(b".", b",").replace(b"JOINT Spine", b"JOINT Spi.ne,1").replace(b"\n", b"\r\n"),
    ],
)
def test_dress_of_numbers_without_a_second_meaning_is_read(tmp_path: Path, text: bytes) -> None:
    plain, dressed = _save(tmp_path / "plain.bvh", GOOD), _save(tmp_path / "dressed.bvh", text)
    expected, document = bvh.parse(plain), bvh.parse(dressed)
    assert (document.values == expected.values).all()
    assert (document.hierarchy.offsets == expected.hierarchy.offsets).all()
    assert document.frame_time == expected.frame_time


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (COMMAS, 8, "three finite numbers, found '0 10,5 0'"),  # beside points in the frames
        (GOOD.replace(b"0 10 0", b"0 1,000 0").replace(b".", b""), 8, "found '0 1,000 0'"),  # thousands?
        (GOOD.replace(b"1.5 2 3", b"1,5 2 3"), 20, "frame 2 has '1,5' as number 1"),
        (GOOD.replace(b"1.5 2 3 4 5", b"1.5 2 3\n4 5").replace(b" 9.25", b""), 20, "frame 2 has 3 of 9"),
        (GOOD.replace(b"1.5 2 3 4 5", b"1.5 2 3 4\nx"), 20, "frame 2 has 'x' as number 5"),
    ],
)
def test_dress_of_numbers_with_two_meanings_is_named(
    tmp_path: Path, text: bytes, line: int, words: str
) -> None:
    error = refusal(tmp_path, text)
    assert words in error.problem
    assert error.line == line


@pytest.mark.parametrize("said", [b"0.0", b"", b"nan", b"-nan(ind)", b"inf", b"1.#INF", b"-1.#IND00"])
def test_a_file_without_a_rate_is_read_at_the_one_that_is_said(tmp_path: Path, said: bytes) -> None:
    still = _save(tmp_path / "still.bvh", GOOD.replace(b"0.033333", said))
    with pytest.raises(FileError, match=r"says no time: .* \(rate=30\)"):
        bvh.read(still)
    imported = load(still, Reading(rate=50.0))
    assert imported.motion.fps == 50.0
    assert imported.findings.fps_stated is None
    written = tmp_path / "written.bvh"
    write(written, imported.motion, imported)
    assert bvh.read(written).fps == 50.0


def test_no_channels_at_all(tmp_path: Path) -> None:
    text = b"HIERARCHY\nROOT A\n{\nOFFSET 0 0 0\n}\nMOTION\nFrames: 1\nFrame Time: 1\n"
    assert "no joint has channels" in refusal(tmp_path, text).problem


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


def _save(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def test_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="is a folder"):
        bvh.read(tmp_path)


def test_what_no_body_can_be_is_refused(tmp_path: Path) -> None:
    text = GOOD.replace(b"OFFSET 0 10 0", b"OFFSET 0 1e308 0")
    (tmp_path / "long.bvh").write_bytes(text)
    with pytest.raises(FileError, match="no body is that long"):
        bvh.read(tmp_path / "long.bvh")
