"""The catalogue agrees with the parser, opens nothing twice, and names what cannot be read."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from retarget_bench.errors import some
from retarget_bench.motion.files import catalogue as module
from retarget_bench.motion.files.catalogue import bvh_files, catalogue, contents, fingerprint, inspect

GOOD = """HIERARCHY
ROOT Hips
{
\tOFFSET 0 90 0
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
\tJOINT Spine
\t{
\t\tOFFSET 0 10 0
\t\tCHANNELS 3 Zrotation Xrotation Yrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 5 0
\t\t}
\t}
}
MOTION
Frames: 3
Frame Time: 0.016667
"""
ROW = "0 90 0 1 2 3 4 5 6\n"


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "cache"))


def write(path: Path, text: str | bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.rstrip("\n"),
        lambda text: text + "\n\n",
        lambda text: text.replace("Frames: 3", "Frames:\t3"),
        lambda text: text.replace(ROW, ROW + "\n", 1),
        lambda text: text.replace("Frame Time: 0.016667", "Frame Time: .016667  "),
    ],
)
def test_length_rate_and_content_of_a_file_in_any_dress(tmp_path, change):
    text = change(GOOD + 3 * ROW)
    entry = inspect(write(tmp_path / "a.bvh", text))
    assert (entry.frames, entry.fps, entry.problem) == (3, 60.0, "")
    assert entry.content == hashlib.sha256(text.encode()).hexdigest()


@pytest.mark.parametrize(
    "text",
    [
        GOOD + 2 * ROW,
        GOOD + 4 * ROW,
        GOOD + 2 * ROW + "0 90 0 1 2\n",
        GOOD + 2 * ROW + ROW.replace("6", "nan"),
        GOOD.replace("Frames: 3", "Frames: " + "3" * 5000) + 3 * ROW,
        GOOD.replace("CHANNELS 3", "CHANNELS " + "3" * 5000) + 3 * ROW,
        GOOD,
        "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 12\n",
        b"Kaydara FBX Binary  \x00\x1a\x00" + bytes(100),
        "",
    ],
)
def test_a_damaged_file_has_a_problem_and_raises_nothing(tmp_path, text):
    entry = inspect(write(tmp_path / "a.bvh", text))
    assert entry.problem
    assert entry.frames == 0


def test_a_file_that_is_gone_has_a_problem(tmp_path):
    missing = tmp_path / "gone.bvh"
    assert "cannot be read" in catalogue(tmp_path, [missing])[missing].problem


def test_bodies_are_told_apart_by_offsets_and_not_by_layout(tmp_path):
    one = inspect(write(tmp_path / "a.bvh", GOOD + 3 * ROW))
    indented = inspect(write(tmp_path / "b.bvh", GOOD.replace("\t", "    ") + 3 * ROW))
    taller = inspect(write(tmp_path / "c.bvh", GOOD.replace("0 10 0", "0 11 0") + 3 * ROW))
    assert one.hierarchy == indented.hierarchy != taller.hierarchy


def test_unchanged_files_are_not_opened_again(tmp_path, monkeypatch):
    paths = [write(tmp_path / "in" / f"{n}.bvh", GOOD + 3 * ROW) for n in range(3)]
    first = catalogue(tmp_path / "in", paths)
    opened: list[Path] = []
    monkeypatch.setattr(module, "inspect", lambda path: opened.append(path) or inspect(path))
    assert catalogue(tmp_path / "in", paths) == first
    assert opened == []
    write(paths[1], GOOD.replace("Frames: 3", "Frames: 4") + 4 * ROW)
    assert catalogue(tmp_path / "in", paths)[paths[1]].frames == 4
    assert opened == [paths[1]]


def test_a_damaged_cache_is_built_anew(tmp_path):
    path = write(tmp_path / "in" / "a.bvh", GOOD + 3 * ROW)
    first = catalogue(tmp_path / "in", [path])
    (stored,) = (tmp_path / "cache" / "catalogue").iterdir()
    content = stored.read_bytes()
    for harm in (b"", b"{]", content[:-9], content.replace(b'"frames": 3', b'"frames": 4')):
        stored.write_bytes(harm)
        assert catalogue(tmp_path / "in", [path]) == first


def test_a_cache_that_cannot_be_written_costs_nothing_else(tmp_path, monkeypatch):
    write(tmp_path / "file", "")
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "file" / "below"))
    path = write(tmp_path / "in" / "a.bvh", GOOD + 3 * ROW)
    assert catalogue(tmp_path / "in", [path])[path].frames == 3


def test_fingerprint_follows_names_and_bytes_and_not_order(tmp_path):
    a = inspect(write(tmp_path / "a.bvh", GOOD + 3 * ROW))
    b = inspect(write(tmp_path / "b.bvh", GOOD.replace("90", "91") + 3 * ROW))
    assert fingerprint({"a": a, "b": b}) == fingerprint({"b": b, "a": a})
    assert len({fingerprint({"a": a, "b": b}), fingerprint({"a": b, "b": a}), fingerprint({"a": a})}) == 3


def test_listing_leaves_out_hidden_and_other_files(tmp_path):
    for name in ("b.bvh", "a.BVH", "._a.bvh", "c.fbx"):
        write(tmp_path / name, "")
    (tmp_path / "d.bvh").mkdir()
    assert list(bvh_files(tmp_path)) == ["a", "b"]
    assert contents(tmp_path) == "a.BVH, b.bvh, c.fbx, d.bvh"


def test_long_lists_are_cut():
    assert some(["a", "b", "c"], 2) == "a, b and 1 more"
    assert some(["a", "b"], 2) == "a, b"
