"""A data set that has splits of its own names, from the run to the report."""

from __future__ import annotations

from pathlib import Path

import pytest

from retarget_bench.api import SPLITS
from retarget_bench.cli import main
from retarget_bench.plugins import registry
from retarget_bench.results import result_matrix, store

pytestmark = pytest.mark.usefixtures("in_process")

HERE = Path(__file__).parent
PLUGINS = [HERE / name for name in ("toys/toy_cases.py", "toys/toy_method.py", "split_toys/paced.py")]
OWN = {"slow": "the body takes its time", "fast": "the body hurries"}


@pytest.fixture
def bench(tmp_path, capsys):
    """``bench`` in this process, on results in one folder; its output."""
    for file in PLUGINS:
        registry.add_file(file)

    def call(command: str, *arguments: object) -> str:
        folder = "--out" if command == "run" else "--results"
        with pytest.raises(SystemExit) as stop:
            main([command, *map(str, arguments), folder, str(tmp_path / "runs")])
        captured = capsys.readouterr()
        assert not stop.value.code, captured.err
        return captured.out

    return call


@pytest.fixture
def ran(bench) -> str:
    return bench("run", "toy_method", "copy_rotations", "-d", "paced", "--metrics", "position", "-j", 1)


def test_a_run_has_all_splits_in_the_order_of_the_card(bench, ran, tmp_path):
    assert "slow: 10 cases of 5 clips; fast: 10 cases of 5 clips" in ran
    assert "bench table " in ran
    assert "-s slow" in " ".join(ran.split())
    places = store.find_results(tmp_path / "runs")
    assert {place.split for place in places} == set(OWN)
    assert store.read_header(places[0].header).dataset.splits == OWN
    matrices = result_matrix.result_matrices(places)
    assert [(each.split, each.meaning) for each in matrices] == [*OWN.items()]


def test_tables_explain_them(bench, ran, tmp_path):
    page = tmp_path / "table.html"
    bench("table", "-o", page)
    for split, meaning in OWN.items():
        assert f"{split}: {meaning}." in page.read_text()
    assert not any(meaning in page.read_text() for meaning in SPLITS.values())
    assert "fast" not in bench("table", "-s", "slow")


def test_comparisons_plots_and_reports_have_them(bench, ran, tmp_path):
    output = bench("compare", "toy_method", "copy_rotations")
    assert output.index("slow") < output.index("fast")
    bench("plot", "methods", "-o", tmp_path / "methods.svg")
    drawn = (tmp_path / "methods.svg").read_text()
    assert "slow" in drawn
    assert "fast" in drawn
    bench("report", "--clips", "0", "-o", tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert page.index("slow: 10 cases") < page.index("fast: 10 cases")


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (("run", "toy_method", "-d", "paced"), "paced has no split 'cross'; it has slow and fast"),
        (
            ("compare", "toy_method", "copy_rotations"),
            "no results of split 'cross' here; there are fast, slow",
        ),
        (("table",), "no case is in the split cross; slow and fast have some"),
    ],
)
def test_another_split_is_told_with_those_of_the_data_set(bench, ran, command, message):
    with pytest.raises(AssertionError, match=message):
        bench(*command, "-s", "cross")
