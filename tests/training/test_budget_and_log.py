"""Budgets, the log, and the curves that are drawn from it."""

import csv

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.errors import BenchError, FileError
from retarget_bench.training import log
from retarget_bench.training.config import Budget


# --------------------------------------------------------------------------------------------- budgets
@pytest.mark.parametrize(
    ("text", "budget"),
    [
        ("90s", Budget(seconds=90)),
        ("30m", Budget(seconds=1800)),
        ("1.5h", Budget(seconds=5400)),
        (" 2 H ", Budget(seconds=7200)),
        ("1d", Budget(seconds=86400)),
        ("20000it", Budget(steps=20000)),
    ],
)
def test_budgets_are_time_or_steps(text, budget):
    assert Budget.parse(text) == budget


@pytest.mark.parametrize(
    "text", ["", "30", "m", "-5m", "0h", "1.5it", "0it", "ten minutes", "5 weeks", "1e3it"]
)
def test_what_is_no_budget_is_refused_with_the_way_to_write_one(text):
    with pytest.raises(BenchError, match=r"write time as 90s, 30m, 2h or 1d, or steps as 20000it"):
        Budget.parse(text)


@pytest.mark.parametrize(
    "text", ["9" * 400 + "it", "9" * 400 + "s", "9" * 300 + "it", "1" + "0" * 12 + "d"]
)
def test_a_budget_beyond_all_counting_is_one_short_sentence(text):
    with pytest.raises(BenchError, match=r"is more than any training takes") as caught:
        Budget.parse(text)
    assert len(str(caught.value)) < 100


# ------------------------------------------------------------------------------------------------- log
def fill(folder, steps, start=0, late=0):
    """A log with a row every two steps; a second term appears after step ``late``."""
    writer = log.Log(folder, start)
    for step in range(start + 1, steps + 1):
        writer.add({"a.x": step**0.5} | ({"b.y": -float(step)} if step > late else {}))
        if step % 2 == 0:
            writer.row(step, 0.5 * step, 1e-3, {"validation self e": 7.0} if step % 4 == 0 else {})


def table(folder):
    with (folder / log.NAME).open(newline="") as file:
        return list(csv.DictReader(file))


@given(values=st.lists(st.floats(-1e6, 1e6, width=32), min_size=1, max_size=12))
def test_a_row_has_the_mean_of_what_came_since_the_row_before(tmp_path_factory, values):
    folder = tmp_path_factory.mktemp("log")
    writer = log.Log(folder)
    writer.add({"a.x": 1e9})
    writer.row(1, 0.0, 0.1, {})
    for value in values:
        writer.add({"a.x": value})
    writer.row(1 + len(values), 1.0, 0.1, {})
    last = table(folder)[-1]
    assert float(last["a.x"]) == pytest.approx(np.mean(values), rel=1e-8, abs=1e-8)
    assert int(last["step"]) == 1 + len(values)


def test_a_term_that_comes_later_has_a_column_of_its_own_and_empty_cells_before(tmp_path):
    fill(tmp_path, 8, late=4)
    rows = table(tmp_path)
    assert [row["b.y"] for row in rows] == ["", "", "-5.5", "-7.5"]
    assert [row["validation self e"] for row in rows] == ["", "7", "", "7"]


@pytest.mark.parametrize("cut", [2, 4, 6])
def test_a_log_that_is_cut_back_and_continued_is_the_log_of_an_uninterrupted_run(tmp_path, cut):
    for name in ("whole", "cut"):
        (tmp_path / name).mkdir()
    fill(tmp_path / "whole", 12, late=4)
    fill(tmp_path / "cut", 9, late=4)
    with (tmp_path / "cut" / log.NAME).open("a") as file:
        file.write("10,5.0,0.0")  # killed while it wrote
    fill(tmp_path / "cut", 12, start=cut, late=4)
    assert (tmp_path / "cut" / log.NAME).read_bytes() == (tmp_path / "whole" / log.NAME).read_bytes()


def test_a_log_that_cannot_be_written_is_one_sentence(tmp_path):
    writer = log.Log(tmp_path)
    writer.add({"a.x": 1.0})
    writer.row(1, 0.0, 0.1, {})
    (tmp_path / log.NAME).unlink()
    (tmp_path / log.NAME).mkdir()
    with pytest.raises(FileError, match=r"log.csv: cannot be written"):
        writer.row(2, 0.0, 0.1, {})


# ---------------------------------------------------------------------------------------------- curves
def test_the_thinned_curve_keeps_the_mean_of_all_rows(tmp_path):
    fill(tmp_path, 60)
    thinned = log.losses(tmp_path, 5)
    assert [point["step"] for point in thinned] == [12, 24, 36, 48, 60]
    rows = [float(row["a.x"]) for row in table(tmp_path)]
    assert np.mean([point["a.x"] for point in thinned]) == pytest.approx(np.mean(rows), rel=1e-4)


def test_a_picture_is_drawn_with_and_without_validation(tmp_path):
    fill(tmp_path, 12)
    log.draw(tmp_path, "a title")
    tall = _size(tmp_path / log.PICTURE)
    (tmp_path / "bare").mkdir()
    fill(tmp_path / "bare", 3)
    log.draw(tmp_path / "bare", "a title")
    assert tall[0] == _size(tmp_path / "bare" / log.PICTURE)[0]
    assert tall[1] > _size(tmp_path / "bare" / log.PICTURE)[1]


def _size(path):
    """Width and height of a PNG file, from its header."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
