"""Results in metres, by the height of every target; and values against the source for the usual ones."""

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
from retarget_bench.api import Comparison, MetricCard, Value
from retarget_bench.cli import group
from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import case_metadata
from retarget_bench.results.metres import in_metres
from retarget_bench.results.predictions import read_prediction
from retarget_bench.results.result_matrix import result_matrices
from retarget_bench.tables import builder

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


# --------------------------------------------------------------------------------------- against the source
NEEDS = VALUES | {"mpjpe_h.world": VALUES["mpjpe_h.world"] | {"needs": ["reference"]}}


@pytest.fixture
def root(tmp_path):
    """A method with values of both kinds."""
    numbers = [
        ("a>b", f"c{n}", {"mpjpe_h.world": 1.0, "ratio": 1.25, "ratio_src": 1.75, "pooled": 3.0})
        for n in range(3)
    ]
    changed(store(tmp_path / "runs", "cross", "m", numbers), values=NEEDS)
    return tmp_path / "runs"


def row_of(*words: object) -> dict[str, str]:
    (row,) = table(*words, "-s", "cross")
    return row


def test_the_stored_value_against_the_source_is_shown_under_its_own_id(root):
    assert row_of(root, "--columns", "ratio")["ratio"] == "1.25"
    row = row_of(root, "--columns", "ratio", "--against", "source")
    assert row["ratio_src"] == "1.75"
    assert "ratio" not in row
    shown = str(rb.load_results(root).table("ratio", against="source"))
    assert "source →1" in shown


def test_it_is_no_column_of_its_own(root):
    summaries = summary.split_summaries(list(rb.load_results(root).places))
    assert "ratio_src" not in builder.all_columns(summaries)
    row = row_of(root, "--all")
    assert row["ratio"] == "1.25"
    assert "ratio_src" not in row
    both = row_of(root, "--all", "--against", "source")
    assert (both["ratio_src"], both["pooled"]) == ("1.75", "3")
    assert "mpjpe_h.world" not in both, "it needs a reference"


def test_a_value_that_does_not_exist_so_is_named_with_those_that_do(root):
    shown = rb.load_results(root).table("mpjpe_h.world", against="source")
    with pytest.raises(BenchError, match=r"^mpjpe_h.world \(world\) is not .*that are: ratio \(ratio\)"):
        str(shown)


def test_a_declaration_says_both():
    value = Value(
        "held", "hold", "share of the reference's frames that are held", "1", "higher", "a / b", "here",
        needs=("reference", "ground"), tolerance=0.5, source_formula="a / c",
    )  # fmt: skip
    (first, second) = MetricCard("m", "", "1", (value,)).computed
    assert first is value
    assert (second.id, second.label, second.formula) == ("held_src", "hold, source", "a / c")
    assert second.meaning == "share of the source's frames that are held"
    assert (second.needs, second.tolerance) == (("source", "ground"), 0.5)
    assert second.from_source is None
