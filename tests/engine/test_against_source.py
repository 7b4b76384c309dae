"""``--against source``: the values against the source that results hold, in the place of the usual ones."""

from __future__ import annotations

import csv

import pytest
from click.testing import CliRunner
from stored import VALUES, changed, store

import retarget_bench as rb
from retarget_bench.analysis import summary
from retarget_bench.api import MetricCard, Value
from retarget_bench.cli import group
from retarget_bench.errors import BenchError
from retarget_bench.tables import builder

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


def table(*words: object) -> dict[str, str]:
    result = CliRunner().invoke(group, ["table", "-r", *map(str, words), "-f", "csv", "-s", "cross"])
    assert result.exit_code == 0, result.output
    (row,) = csv.DictReader(result.output.splitlines())
    return row


def test_the_stored_value_against_the_source_is_shown_under_its_own_id(root):
    assert table(root, "--columns", "ratio")["ratio"] == "1.25"
    row = table(root, "--columns", "ratio", "--against", "source")
    assert row["ratio_src"] == "1.75"
    assert "ratio" not in row
    shown = str(rb.load_results(root).table("ratio", against="source"))
    assert "source →1" in shown


def test_it_is_no_column_of_its_own(root):
    summaries = summary.split_summaries(list(rb.load_results(root).places))
    assert "ratio_src" not in builder.all_columns(summaries)
    row = table(root, "--all")
    assert row["ratio"] == "1.25"
    assert "ratio_src" not in row
    both = table(root, "--all", "--against", "source")
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
