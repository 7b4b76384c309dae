"""Results of many cases, stored as Parquet: the same numbers as from text, and the same care."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from small_plans import asked
from stored import changed, running, unchecked
from stored import store as made_up

from retarget_bench.analysis.breakdown import breakdown
from retarget_bench.analysis.summary import split_summaries, split_summary
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import runner
from retarget_bench.results import rows, store
from retarget_bench.results.paths import LARGE, ResultPaths
from retarget_bench.results.result_matrix import result_matrices
from retarget_bench.tables import requested
from retarget_bench.tables.requested import Request

METHODS = ("a", "b", "refuses", "control")


def results(root: Path) -> list[ResultPaths]:
    """Methods that differ, one that answers three quarters of the cases, a control; curves and gaps."""
    random = np.random.default_rng(0)
    places = []
    for method in METHODS:
        numbers: list = []
        for n in range(80):
            values = {"mpjpe_h.world": float(random.lognormal()), "ratio": 1 + 1 / (n + 3)}
            values["curve"] = {"0.1": float(random.random()), "0.2": 1 / 3}
            if n % 5 == 0:
                del values["ratio"], values["curve"]["0.2"]
            refused = method == "refuses" and n % 4 == n // 4 % 4
            numbers.append((f"a>{'bcde'[n % 4]}", f"clip, {n // 4}", "failed" if refused else values))
        places.append(made_up(root, "cross", method, numbers, control=method == "control"))
    return places


@pytest.fixture
def text(tmp_path) -> list[ResultPaths]:
    return results(tmp_path / "text")


@pytest.fixture
def large(tmp_path, monkeypatch) -> list[ResultPaths]:
    monkeypatch.setattr(rows, "MANY", 0)
    return results(tmp_path / "large")


def test_numbers_are_the_same_to_the_last_bit(text, large):
    for one, other in zip(result_matrices(text), result_matrices(large), strict=True):
        assert one.cases == other.cases
        assert set(one.keys) == set(other.keys)
        for key in one.keys:
            np.testing.assert_array_equal(one.numbers(key), other.numbers(key))
        for part, twin in zip(breakdown(one, "clip"), breakdown(other, "clip"), strict=True):
            assert split_summary(part).rankings == split_summary(twin).rankings
    for one, other in zip(text, large, strict=True):
        was, now = store.read_results(one), store.read_results(other)
        assert now.entries == was.entries
        assert now.header.counts == was.header.counts


def test_only_what_a_table_shows_is_read(large, monkeypatch):
    read: list[str] = []
    plain = pyarrow.parquet.ParquetFile.read

    def spy(self, columns):
        read.extend(columns)
        return plain(self, columns=columns)

    monkeypatch.setattr(pyarrow.parquet.ParquetFile, "read", spy)
    requested.tables(large, Request())
    assert set(read) == {"mpjpe_h.world"}


def test_a_run_writes_either_form_and_leaves_nothing_of_the_other(tmp_path, monkeypatch, in_process, toys):
    contents = []
    for many in (0, 10**9, 0):
        monkeypatch.setattr(rows, "MANY", many)
        (place,) = runner.run(asked(tmp_path, "toy_method", overwrite="always"), lambda *_: None)
        assert place.large.exists() == (not many) != place.rows.exists() == place.arrays.exists()
        arrays = {
            key: column.tolist() for key, column in store.read_results(place, arrays=True).numbers.items()
        }
        assert {value for value, _ in arrays} >= {"mpjpe_h.joint"}
        contents.append((store.read_results(place).entries, arrays))
    assert contents[0] == contents[1] == contents[2]


# ------------------------------------------------------------------------------------------------ damage


def test_a_damaged_page_is_named_where_no_checksum_tells(large):
    place = large[0]
    content = bytearray(place.large.read_bytes())
    facts = pyarrow.parquet.ParquetFile(place.large).metadata.row_group(0)
    (page,) = (
        c for c in map(facts.column, range(facts.num_columns)) if c.path_in_schema == "mpjpe_h.world"
    )
    content[page.data_page_offset + page.total_compressed_size - 3] ^= 1
    place.large.write_bytes(content)
    with pytest.raises(FileError, match=r"a\.parquet: is not as it was written"):
        requested.tables([place], Request())
    changed(place, files={LARGE: store.checksum(place.large)})
    with pytest.raises(FileError, match=r"a\.parquet: cannot be read"):
        requested.tables([place], Request())


def test_a_case_list_of_another_length_is_refused(large):
    unchecked(large[0].root)
    lines = large[0].cases.read_text().splitlines(keepends=True)
    large[0].cases.write_text("".join(lines[:-1]))
    for path in large:
        changed(path, files={LARGE: store.checksum(path.large)})
    with pytest.raises(FileError, match=r"has 80 rows, and .* lists 79 cases"):
        split_summaries([large[0]])


def test_without_pyarrow_the_way_to_it_is_told_before_anything_is_computed(large, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    for ask in (lambda: split_summaries(large), lambda: running(large[0], 1)):
        with pytest.raises(BenchError, match=r"pip install 'retarget-bench\[store\]'"):
            ask()
