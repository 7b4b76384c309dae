"""Charts of noise, of given joints and of speed in a report: a mark for every number of the tables."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import pytest

from retarget_bench.evaluation import timing
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from tests.engine import stored
from tests.engine.small_plans import asked
from tests.in_process import run_here
from tests.report.odd_runs import bench, report

TOYS = Path(__file__).parents[1] / "tasks" / "toys" / "toy_people.py"


def marks(root: Path, name: str) -> dict[tuple[str, str], float]:
    """(method, level) -> the first number that the mark of the report's chart says."""
    file = root / "r.html"
    report(root, "-o", file, "--clips", "0")
    (section,) = re.findall(
        rf'id="chapter-1-{name}">(.*?)</section>', file.read_text(encoding="utf-8"), re.S
    )
    chart, *_ = re.findall(r"<svg.*?</svg>", section, re.S)
    numbers = {}
    for method, group in re.findall(r'<g[^>]* data-method="([^"]*)"[^>]*>(.*?)</g>', chart, re.S):
        for tag in re.findall(r"<use[^>]*>", group):
            attributes = dict(re.findall(r'([a-z-]+)="([^"]*)"', tag))
            number = float(re.search(r": ([\d.e+]+)", attributes["aria-label"])[1])
            numbers[method, attributes.get("data-level", "")] = number
    return numbers


@pytest.mark.parametrize(
    ("task", "methods"),
    [
        ("denoise[levels='0,2,5']", ("identity", "gaussian_filter")),
        ("joint-completion[levels='0.5,0.75,1']", ("linear_joints", "nearest_pose")),
    ],
)
def test_every_level_has_the_number_of_the_table(tmp_path, task, methods):
    registry.add_file(TOYS)
    about = {"splits": ("self",), "metrics": ("restoration",), "task": task}
    run_here(asked(tmp_path, *methods, data="toy_people[clips=2]", **about))
    name = Spec.parse(task).name
    table = csv.DictReader(io.StringIO(bench("table", "-r", tmp_path, "--task", name, "-f", "csv")))
    rows = [row for row in table if row.get("value") in (None, "restored_cm")]
    expected = {(method, row["level"]): float(row[method]) for row in rows for method in methods}
    assert marks(tmp_path, name) == pytest.approx(expected, abs=0.006)
    assert len(expected) == 6


def test_methods_that_were_timed_stand_over_their_speed(tmp_path):
    speeds = {"slow": 30.0, "even": 300.0, "quick": 3000.0}
    for method, fps in speeds.items():
        rows = [("a>b", f"c{k}", {"mpjpe_h.world": 0.1 * k}) for k in range(12)]
        timing.write(stored.store(tmp_path, "intra", method, rows), [timing.Time("c", round(3 * fps), 3.0)])
    errors = {(each, ""): pytest.approx(0.55, abs=0.01) for each in speeds}  # of 0 to 1.1
    assert marks(tmp_path, "speed") == errors
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    said = dict(re.findall(r'aria-label="(\w+), ([\d,e+]+) frames per second: ', text))
    assert {each: float(number.replace(",", "")) for each, number in said.items()} == pytest.approx(speeds)
