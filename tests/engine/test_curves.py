"""Curves in tables: a line per point, means of those that have it, and long clips alone."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from stored import VALUES, changed, store, unchecked

from retarget_bench.analysis import summary
from retarget_bench.cli import group
from retarget_bench.errors import BenchError
from retarget_bench.results import store as records

OVER_TIME = VALUES["curve"] | {"index": "second", "label": "over time", "better": "lower"}
PLAIN = {key: value for key, value in VALUES.items() if not value["index"]}
LENGTHS = {f"c{n:02}": 3 if n < 12 else 12 for n in range(16)}
"""Clip -> seconds that it lasts."""


def error(clip: str, second: int) -> float:
    return 1.0 + int(clip[1:]) / 100 + second


@pytest.fixture
def results(tmp_path, monkeypatch) -> Path:
    """Two methods; the second one's errors are twice the first one's, and it fails on a long clip."""
    monkeypatch.setitem(VALUES, "growth", OVER_TIME)
    for name, factor in (("one", 1.0), ("two", 2.0)):
        numbers = []
        for clip, seconds in LENGTHS.items():
            curve = {str(s): factor * error(clip, s) for s in range(1, seconds + 1)}
            values = {
                "mpjpe_h.world": factor,
                "growth": curve,
                "curve": {"0.5": 0.25, "2": 0.75, "10": 1.0},
            }
            numbers.append(("a>b", clip, "failed" if (name, clip) == ("two", "c15") else values))
        store(tmp_path / "runs", "intra", name, numbers)
    return tmp_path / "runs"


def bench(*words) -> str:
    result = CliRunner().invoke(group, ["table", "-r", *map(str, words)])
    assert result.exit_code == 0, result.output or result.exception
    return result.output


def lines(*words) -> dict[str, dict[str, str]]:
    """The table as CSV, by the name of each part."""
    rows = csv.DictReader(io.StringIO(bench(*words, "-f", "csv")))
    return {row["second"]: row for row in rows}


def test_a_curve_has_a_line_per_second_with_the_mean_of_the_cases_that_have_it(results):
    printed = lines(results, "--columns", "growth")
    assert list(printed) == [str(second) for second in range(1, 13)]  # 10 after 9, not after 1
    for second, row in printed.items():
        there = [clip for clip, lasts in LENGTHS.items() if lasts >= int(second)]
        errors = [error(clip, int(second)) for clip in there]
        assert float(row["one"]) == pytest.approx(np.mean(errors))
        assert float(row["two"]) == pytest.approx(2 * np.mean(errors[:-1]))  # c15 failed
        assert (row["n"], row["two:n"]) == (str(len(there)), str(len(there) - 1))


def test_asking_for_a_curve_is_asking_for_the_breakdown(results):
    assert bench(results, "--columns", "growth") == bench(results, "--columns", "growth", "--by", "second")
    assert "by threshold" in bench(results, "--columns", "curve")
    assert bench(results, "--by", "threshold") == bench(results, "--columns", "curve")


def test_curves_do_not_mix_with_single_numbers(results):
    result = CliRunner().invoke(group, ["table", "-r", str(results), "--columns", "growth,mpjpe_h.world"])
    assert "growth has a number per second and cannot stand beside" in str(result.exception)


def test_long_clips_alone(results):
    printed = lines(results, "--columns", "growth", "--at-least", 10)
    long = [clip for clip, lasts in LENGTHS.items() if lasts >= 10]
    for second, row in printed.items():
        assert float(row["one"]) == pytest.approx(np.mean([error(clip, int(second)) for clip in long]))
        assert row["n"] == "4"
    shown = bench(results, "--at-least", 10)
    assert "intra: 4 cases of 4 clips" in shown
    assert "Only clips of 10 s or longer" in shown
    assert "Only clips" not in bench(results)
    (section,) = summary.split_summaries(records.find_results(results), at_least=12)
    assert [(score.asked, score.ok) for score in section.scores] == [(4, 4), (4, 3)]


@pytest.mark.parametrize(
    ("changes", "words", "message"),
    [
        ({}, ["--at-least", "13"], "no case lasts 13 s"),
        ({"values": PLAIN}, ["--at-least", "3"], "the durations of clips are unknown; bench run"),
        ({"values": PLAIN}, ["--by", "second"], "there is no curve over second; bench run"),
        ({}, ["--at-least", "3", "--paper", "pan-table1"], "--paper has columns and splits of its own"),
    ],
)
def test_what_cannot_be_shown_is_told(results, changes, words, message):
    for place in records.find_results(results):
        changed(place, **changes)
    result = CliRunner().invoke(group, ["table", "-r", str(results), *words])
    assert isinstance(result.exception, BenchError)
    assert message in str(result.exception)


def test_points_without_a_number_for_a_name_come_last(results):
    unchecked(results)
    for place in records.find_results(results):
        place.rows.write_text(place.rows.read_text().replace(",growth,3,", ",growth,late,"))
    assert list(lines(results, "--columns", "growth"))[-1] == "late"


def test_first_sight_and_all_show_no_curve(results):
    for words in ([], ["--all"]):
        assert "over time" not in bench(results, *words)
