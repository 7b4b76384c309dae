"""Rows read as columns to the last bit; faults are named by their line."""

import numpy as np
import pandas as pd
import pytest
from stored import store, unchecked

from retarget_bench.errors import FileError
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


def test_columns_and_entries_are_what_another_reader_reads(place):
    results = records.read_results(place)
    rows = pd.read_csv(place.rows, dtype=str, na_filter=False)
    rows["value"] = rows["value"].map(float)
    expected = rows.pivot(index="case", columns=["value_id", "index"], values="value")
    assert set(results.numbers) == set(expected.columns)
    for key, column in results.numbers.items():
        np.testing.assert_array_equal(column, expected[key].reindex([info.id for info in results.infos]))
    assert np.isnan(results.numbers["ratio", ""]).sum() == 2
    entries = {entry.case: entry.values for entry in results.entries}
    for case, value_id, index, number in rows.itertuples(index=False):
        there = entries[case][value_id]
        assert (there[index] if index else there) == number


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
def test_faults_are_named(place, old, new, message):
    unchecked(place.root)
    place.rows.write_text(place.rows.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    with pytest.raises(FileError, match=message):
        records.read_results(place)


@pytest.mark.parametrize("file", ["rows", "cases"])
def test_what_stands_twice_is_named(place, file):
    unchecked(place.root)
    path = getattr(place, file)
    text = path.read_text(encoding="utf-8")
    path.write_text(text + text.splitlines(keepends=True)[1], encoding="utf-8")
    with pytest.raises(FileError, match="is listed twice"):
        records.read_results(place)
