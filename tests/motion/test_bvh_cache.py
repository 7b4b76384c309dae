"""The cache of parsed files: it never changes what is read, whatever happens to it."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest
from test_bvh_faults import GOOD

from retarget_bench.errors import FileError
from retarget_bench.motion import bvh
from retarget_bench.motion.bvh import cache as bvh_cache

OTHER = GOOD.replace(b"1.5 2 3", b"7.5 2 3")


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "bvh"


def clip(folder: Path, data: bytes = GOOD, *, old: bool = True, name: str = "clip.bvh") -> Path:
    """A file that seems to have been there for a while: its times are then trusted."""
    path = folder / name
    path.write_bytes(data)
    if old:
        age(path)
    return path


def age(path: Path) -> None:
    os.utime(path, (time.time() - 100, time.time() - 100))


@pytest.fixture
def trusting(monkeypatch: pytest.MonkeyPatch) -> None:
    """No file counts as young (a test cannot set the time of the last change of a file's record)."""
    monkeypatch.setattr(bvh_cache, "_SETTLED", -1e9)


def count_parses(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    parsed: list[Path] = []
    original = bvh._parse
    monkeypatch.setattr(bvh, "_parse", lambda path, data: parsed.append(path) or original(path, data))
    return parsed


def same(a: bvh.Document, b: bvh.Document) -> bool:
    return (
        a.values.tobytes() == b.values.tobytes()
        and a.hierarchy.names == b.hierarchy.names
        and a.hierarchy.channels == b.hierarchy.channels
        and a.hierarchy.end_sites == b.hierarchy.end_sites
        and a.hierarchy.offsets.tobytes() == b.hierarchy.offsets.tobytes()
        and a.hierarchy.parents.tolist() == b.hierarchy.parents.tolist()
        and a.frame_time == b.frame_time
    )


def test_a_file_is_parsed_once(tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parsed = count_parses(monkeypatch)
    path = clip(tmp_path)
    first, second = bvh.parse(path), bvh.parse(path)
    assert len(parsed) == 1
    assert same(first, second)
    assert not second.values.flags.writeable
    moved = tmp_path / "moved.bvh"
    moved.write_bytes(GOOD)
    assert same(bvh.parse(moved), first)
    assert len(parsed) == 1, "the same content under another name is the same document"
    assert len(list(cache.glob("*.bin"))) == 1


@pytest.mark.usefixtures("trusting", "cache")
def test_a_known_path_is_not_even_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = clip(tmp_path)
    first = bvh.parse(path)
    monkeypatch.setattr(bvh, "_read", lambda path: pytest.fail(f"{path} was read"))
    assert same(bvh.parse(path), first)


@pytest.mark.usefixtures("cache")
def test_a_change_is_seen_at_once(tmp_path: Path) -> None:
    path = clip(tmp_path, old=False)
    for data, number in ((GOOD, 1.5), (OTHER, 7.5)) * 3:  # same size, within the same clock tick
        path.write_bytes(data)
        assert bvh.parse(path).values[1, 0] == number


@pytest.mark.usefixtures("trusting", "cache")
def test_a_change_of_a_known_path_is_seen(tmp_path: Path) -> None:
    path = clip(tmp_path)
    bvh.parse(path)
    time.sleep(0.02)
    assert bvh.parse(clip(tmp_path, OTHER)).values[1, 0] == 7.5, (
        "same size, same path, same modification time"
    )


@pytest.mark.usefixtures("trusting")
@pytest.mark.parametrize("harm", ["words", "foreign", "name", "folder"])
def test_a_damaged_cache_is_rebuilt(tmp_path: Path, cache: Path, harm: str) -> None:
    path = clip(tmp_path)
    document = bvh.parse(path, cache=False)
    bvh.parse(path)
    stored, entry = next(cache.glob("*.bin")), next((cache / "by_path").iterdir())
    data = stored.read_bytes()
    if harm == "words":
        stored.write_bytes(data[:-16] + data[-8:] + data[-16:-8])
    elif harm == "foreign":
        bvh.parse(other := clip(tmp_path, OTHER, name="other.bvh"))
        assert bvh.parse(other).values[1, 0] == 7.5
        stored.write_bytes(next(each for each in cache.glob("*.bin") if each != stored).read_bytes())
    elif harm == "name":
        entry.unlink()
        entry.write_bytes(b"something else")
    else:
        stored.unlink()
        stored.mkdir()
    for _ in range(3):
        assert same(bvh.parse(path), document)
    if harm != "folder":
        assert stored.read_bytes() == data


def test_every_cut_and_every_flipped_bit_is_noticed(tmp_path: Path, cache: Path) -> None:
    """Also where the tail that is missing adds up to nothing: numbers that are 0."""
    bvh.parse(clip(tmp_path, GOOD.replace(b"1.5 2 3", b"0 0 0")))
    (stored,) = cache.glob("*.bin")
    data = stored.read_bytes()
    for at in range(len(data)):
        for harmed in (data[:at], data[:at] + bytes([data[at] ^ (1 << at % 8)]) + data[at + 1 :]):
            stored.write_bytes(harmed)
            assert bvh_cache.load(stored.stem) is None, f"byte {at}"


def test_another_parser_reads_the_text_anew(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bvh.parse(clip(tmp_path))
    parsed = count_parses(monkeypatch)
    monkeypatch.setattr(bvh_cache, "_VERSION", "bvh 99")
    bvh.parse(clip(tmp_path))
    assert len(parsed) == len(list(cache.glob("*.bin"))) == 1


def test_a_cache_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "file" / "cache"))
    path = clip(tmp_path)
    np.testing.assert_array_equal(bvh.parse(path).values, bvh.parse(path, cache=False).values)


def test_nothing_is_kept_of_a_bad_file(tmp_path: Path, cache: Path) -> None:
    path = clip(tmp_path, GOOD[:-20])
    for _ in range(2):
        with pytest.raises(FileError, match="cut off"):
            bvh.parse(path)
    assert not cache.exists()
