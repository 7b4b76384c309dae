"""Results in metres: the distances themselves, by the height of every case's target."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from small_plans import carry_out
from stored import VALUES, changed, metadata, store

import retarget_bench as rb
from retarget_bench.analysis import summary
from retarget_bench.api import Comparison
from retarget_bench.cli import group
from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import case_metadata
from retarget_bench.results.metres import in_metres
from retarget_bench.results.predictions import read_prediction
from retarget_bench.results.result_matrix import result_matrices

pytestmark = pytest.mark.usefixtures("in_process", "toys")

SHIFT = 0.01  # as in toys/toy_cases.py
HEIGHTS = {"b": 1.0, "c": 3.0}
PER_CENT = VALUES["mpjpe_h.world"] | {"unit": "% of height", "protocol": {"divided by": "h"}}


def test_they_are_the_distances_of_the_answers(tmp_path):
    """As they were stored once: mean distances of joints in metres, to nine digits."""
    (results,) = carry_out(tmp_path, "toy_method")
    (matrix,) = map(in_metres, result_matrices([results.paths]))
    numbers = matrix.numbers(("mpjpe_h.world", ""))[0]
    data = bound.dataset(Spec.parse("toy_cases[clips=3]")).built
    assert len({data.load(info).target.height for info in matrix.cases}) == 2
    for info, number in zip(matrix.cases, numbers, strict=True):
        case = data.load(info)
        answer = read_prediction(results.paths.prediction(info.id), case.target, case.source.fps)
        comparison = Comparison(case, answer)
        distances = np.linalg.norm(comparison.predicted - comparison.expected, axis=-1)
        assert number == pytest.approx(distances[:, comparison.joints].mean(), rel=1e-9)
        assert number == pytest.approx(SHIFT, rel=1e-5)
    facts = matrix.values["mpjpe_h.world"]
    assert (facts.unit, facts.protocol["divided by"]) == ("m", "1")


def tall_and_small(root: Path) -> Path:
    """Two methods over 12 clips to a body of one metre, and to one of three. ``one`` errs more on the small
    body and less on the tall one: on average less in metres, and more in per cent."""
    for name, (small, tall) in {"one": (5.0, 1.0), "two": (2.0, 3.0)}.items():
        numbers = [
            (f"a>{target}", f"c{n}", {"mpjpe_h.world": value + n / 10, "ratio": 1.5})
            for n in range(12)
            for target, value in (("b", small), ("c", tall))
        ]
        place = store(root, "cross", name, numbers)
        changed(place, values=VALUES | {"mpjpe_h.world": PER_CENT})
    metadata(place, height={name: f"{height:g}" for name, height in HEIGHTS.items()})
    return root


def table(*words: object) -> list[dict[str, str]]:
    result = CliRunner().invoke(group, ["table", "-r", *map(str, words), "-f", "csv"])
    assert result.exit_code == 0, result.output
    return list(csv.DictReader(result.output.splitlines()))


def test_means_intervals_and_ranks_are_those_of_metres(tmp_path):
    root = tall_and_small(tmp_path)
    options = ("--columns", "mpjpe_h.world,ratio", "-s", "cross")
    usual = {row["method"]: row for row in table(root, *options)}
    metres = {row["method"]: row for row in table(root, *options, "--unit", "m")}
    n = np.arange(12) / 10
    for name, (small, tall) in {"one": (5.0, 1.0), "two": (2.0, 3.0)}.items():
        each = ((small + n) * HEIGHTS["b"] + (tall + n) * HEIGHTS["c"]) / 2 / 100
        assert float(metres[name]["mpjpe_h.world"]) == pytest.approx(each.mean(), rel=1e-9)
        assert float(metres[name]["mpjpe_h.world:low"]) < each.mean()
        assert float(metres[name]["mpjpe_h.world:high"]) > each.mean()
        assert metres[name]["ratio"] == usual[name]["ratio"]
    # neither the mean in per cent times the mean height, nor its order
    assert float(usual["one"]["mpjpe_h.world"]) > float(usual["two"]["mpjpe_h.world"])
    assert (usual["two"]["mpjpe_h.world:mark"], metres["one"]["mpjpe_h.world:mark"]) == ("best", "best")


def test_the_text_says_metres(tmp_path):
    root = tall_and_small(tmp_path)
    usual, shown = (rb.load_results(root).table("world", unit=unit) for unit in ("", "m"))
    assert "data in metres" in str(shown)
    assert "in metres" not in str(rb.load_results(root).table("ratio", unit="m"))
    assert [set(each.frame["unit"]) for each in (usual, shown)] == [{"% of height"}, {"m"}]
    assert "in m, by pair" in str(rb.load_results(root).table("world", unit="m", by="pair"))


def test_results_without_heights_are_told_and_a_run_adds_them(tmp_path):
    (results,) = carry_out(tmp_path, "toy_method")
    heights = case_metadata.read(results.paths).heights
    case_metadata.path_of(results.paths).unlink()
    with pytest.raises(BenchError, match="do not say how tall their targets are"):
        summary.split_summaries([results.paths], metres=True)
    summary.split_summaries([results.paths])
    carry_out(tmp_path, "toy_method")
    assert case_metadata.read(results.paths).heights == heights
    assert set(heights) == {"small", "tall"}
