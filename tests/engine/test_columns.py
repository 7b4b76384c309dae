"""Rows read as columns: both readers agree to the last bit, and faults are named by their line."""

import numpy as np
import pytest
from stored import store, unchecked

from retarget_bench.errors import FileError
from retarget_bench.results import columns, compatibility
from retarget_bench.results import store as records
from retarget_bench.results.store import ResultPaths


@pytest.fixture
def place(tmp_path) -> ResultPaths:
    """Clips with commas, quotes and words that readers may take for missing; some cases lack values."""
    random = np.random.default_rng(0)
    cases = []
    for clip in ("walk, slow", 'the "best"', "NA", "nan", "None", "é ü", "plain"):
        for pair in ("a>b", "b>a"):
            values = {
                "mpjpe_h.world": float(random.lognormal(sigma=9)),
                "curve": {"0.1": 0.5, "NA": 1e-300},
            }
            if clip != "NA":
                values["ratio"] = float(random.normal())
            cases.append((pair, clip, values))
    return store(tmp_path, "intra", "m", cases)


def read(place: ResultPaths, monkeypatch, large: int) -> columns.Columns:
    monkeypatch.setattr(columns, "LARGE", large)
    header = records.read_header(place.header)
    return columns.read(place, header, compatibility.newest([header]))


def test_the_fast_reader_reads_what_the_careful_one_reads(place, monkeypatch):
    careful = read(place, monkeypatch, 10**9)
    monkeypatch.setattr(columns, "_slow", None)  # not asked: the fast one is enough
    fast = read(place, monkeypatch, 0)
    assert fast.numbers.keys() == careful.numbers.keys()
    for key, column in careful.numbers.items():
        np.testing.assert_array_equal(fast.numbers[key], column)
    assert np.isnan(careful.numbers["ratio", ""]).sum() == 2
    entries = {entry.case: entry.values for entry in records.read_results(place).entries}
    for info, number in zip(careful.cases, careful.numbers["curve", "NA"], strict=True):
        assert entries[info.id]["curve"]["NA"] == number


@pytest.mark.parametrize("large", [0, 10**9], ids=["fast", "careful"])
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (",0.5\n", ",half\n", r"m\.csv:\d+: 'half' is not a number"),
        (",0.5\n", ",inf\n", r"m\.csv:\d+: 'inf' is not a number"),
        (",0.5\n", ",0.5,1\n", r"m\.csv:\d+: has 5 cells instead of 4"),
        ("data/a>b/plain", "data/a>b/stranger", r"names case 'data/a>b/stranger', which .* does not list"),
        ("case,value_id", "value_id,case", "expected case, value_id"),
        (",curve,0.1,", ",curve,,", "both a number and a curve"),
    ],
)
def test_faults_are_named_whoever_reads(place, monkeypatch, large, old, new, message):
    unchecked(place.root)
    place.rows.write_text(place.rows.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    with pytest.raises(FileError, match=message):
        read(place, monkeypatch, large)


@pytest.mark.parametrize("large", [0, 10**9], ids=["fast", "careful"])
@pytest.mark.parametrize("file", ["rows", "cases"])
def test_what_stands_twice_is_named_whoever_reads(place, monkeypatch, large, file):
    unchecked(place.root)
    path = getattr(place, file)
    text = path.read_text(encoding="utf-8")
    path.write_text(text + text.splitlines(keepends=True)[1], encoding="utf-8")
    with pytest.raises(FileError, match="stands twice"):
        read(place, monkeypatch, large)
