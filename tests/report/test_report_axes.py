"""Charts of noise, of given joints and of speed: their marks stand where the tables' numbers are."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from retarget_bench.evaluation import timing
from retarget_bench.evaluation.plan import Plan
from retarget_bench.figures import axis_limits
from retarget_bench.figures.svg import elements
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from tests.engine import stored
from tests.in_process import run_here
from tests.report.odd_runs import bench, report

TOYS = Path(__file__).parents[1] / "tasks" / "toys" / "toy_people.py"
SPEEDS = {"slow": (9.0, 30.0), "even": (4.0, 300.0), "quick": (6.0, 3000.0)}
"""Method -> error, frames per second."""


def carried_out(root: Path, task: str, *methods: str) -> None:
    registry.add_file(TOYS)
    plan = Plan(
        methods=tuple(map(Spec.parse, methods)),
        datasets=(Spec.parse("toy_people[clips=2]"),),
        splits=("self",),
        metrics=("restoration",),
        task=task,
        out=root,
    )
    run_here(plan)


def table(root: Path, task: str, *more: str) -> list[dict[str, str]]:
    """The table as CSV: lines by column."""
    text = bench("table", "-r", root, "--task", task, *more, "-f", "csv")
    return list(csv.DictReader(io.StringIO(text)))


def chart(root: Path, file: Path, name: str) -> ElementTree.Element:
    """The first chart of this name in the report."""
    report(root, "-o", file, "--clips", "0")
    section = re.search(rf'id="chapter-1-{name}">(.*?)</section>', file.read_text(encoding="utf-8"), re.S)
    assert section
    drawn, *_ = re.findall(r"<svg.*?</svg>", section[1], re.S)
    return ElementTree.fromstring(drawn)


def axis(drawn: ElementTree.Element, anchor: str, log: bool = False) -> np.poly1d:
    """From places to numbers, by the ticks that stand to the left (``end``) or below (``middle``)."""
    found = []
    for each in drawn.iter("text"):
        if each.get("text-anchor") == anchor and not each.get("class") and each.get("x") != "0":
            number = float((each.text or "").replace(",", ""))
            at = float(each.get("y", "")) - 3.5 if anchor == "end" else float(each.get("x", ""))
            found.append((at, np.log10(number) if log else number))
    assert len(found) >= 3
    places, numbers = zip(*found, strict=True)
    return np.poly1d(np.polyfit(places, numbers, 1))


def marks(drawn: ElementTree.Element, log: bool = False) -> dict[tuple[str, str], tuple[float, float, str]]:
    """(method, level) -> where its mark stands, read by the axes, and what it says."""
    across, up = axis(drawn, "middle", log), axis(drawn, "end")
    found = {}
    for each in drawn.iter("g"):
        if each.get("class") == "pick":
            (dot,) = each.iter("path")
            x, y = map(float, re.findall(r"[\d.]+", dot.get("transform", ""))[:2])
            key = each.get("data-method", ""), each.get("data-level", "")
            x_number = float(across(x))
            found[key] = 10**x_number if log else x_number, float(up(y)), each.get("aria-label", "")
    return found


def said(label: str) -> float:
    """The first number after the colon."""
    return float(re.search(r": ([\d.]+)", label)[1])


@pytest.fixture(scope="module")
def tasks(tmp_path_factory):
    root = tmp_path_factory.mktemp("levels")
    carried_out(root / "noise", "denoise[levels='0,2,5']", "identity", "gaussian_filter")
    carried_out(root / "joints", "upsample[levels='0.5,0.75,1']", "linear_joints", "nearest_pose")
    return root


def test_errors_after_denoising_stand_over_the_errors_before(tasks, tmp_path):
    rows = {row["level"]: row for row in table(tasks / "noise", "denoise")}
    drawn = chart(tasks / "noise", tmp_path / "r.html", "denoise")
    found = marks(drawn)
    assert found.keys() == {(m, level) for m in ("identity", "gaussian_filter") for level in rows}
    for (method, level), (before, after, label) in found.items():
        given, restored = float(rows[level]["identity"]), float(rows[level][method])
        assert (before, after) == pytest.approx(
            (given, restored), abs=0.03
        )  # identity gives back what it got
        assert said(label) == pytest.approx(restored, abs=0.006)
    (nothing,) = (each for each in drawn.iter("line") if each.get("class") == "diagonal")
    across, up = axis(drawn, "middle"), axis(drawn, "end")
    ends = [(across(float(nothing.get(f"x{k}"))), up(float(nothing.get(f"y{k}")))) for k in "12"]
    most = max(float(row["identity"]) for row in rows.values())
    assert ends == [pytest.approx((each, each), abs=0.03) for each in (0, most)]


def test_errors_stand_over_the_share_of_joints_that_was_given(tasks, tmp_path):
    rows = [row for row in table(tasks / "joints", "joint-completion") if row["value"] == "restored_cm"]
    found = marks(chart(tasks / "joints", tmp_path / "r.html", "joint-completion"))
    assert len(found) == 2 * len(rows) == 6
    highest = max(float(row[method]) for row in rows for method in ("linear_joints", "nearest_pose"))
    for row in rows:
        for method in ("linear_joints", "nearest_pose"):
            share, error, label = found[method, row["level"]]
            assert share == pytest.approx(float(row["level"].split()[0]), abs=0.05)
            assert error == pytest.approx(float(row[method]), abs=0.01 * highest)
            assert said(label) == pytest.approx(float(row[method]), abs=0.006)


def test_quality_stands_over_speed_and_the_line_joins_what_nothing_beats(tmp_path):
    for method, (error, fps) in SPEEDS.items():
        rows = [("a>b", f"c{k}", {"mpjpe_h.world": error + 0.1 * k}) for k in range(12)]
        place = stored.store(tmp_path / "runs", "intra", method, rows)
        timing.write(place, [timing.Time("c", round(3 * fps), 3.0)])
    columns = ("--columns", "mpjpe_h.world,fps")
    rows = {row["method"]: row for row in table(tmp_path / "runs", "retarget", *columns)}
    drawn = chart(tmp_path / "runs", tmp_path / "r.html", "speed")
    found = marks(drawn, log=True)
    assert found.keys() == {(method, "") for method in SPEEDS}
    for method, (_, fps) in SPEEDS.items():
        rate, error, label = found[method, ""]
        assert rate == pytest.approx(fps, rel=0.01)
        assert rate == pytest.approx(float(rows[method]["fps"]), rel=0.01)
        assert error == pytest.approx(float(rows[method]["mpjpe_h.world"]), abs=0.05)
        assert f"{method}: {fps:.3g} frames per second" in label
    (front,) = (each for each in drawn.iter("path") if each.get("class") == "front")
    places = re.findall(r"([\d.]+) ([\d.]+)", front.get("d", ""))
    rates = [10 ** float(axis(drawn, "middle", log=True)(float(x))) for x, _ in places[1::2]]
    assert rates == pytest.approx([300, 3000], rel=0.02)  # "slow" is beaten in both


def test_a_colour_scale_ends_before_one_method_that_is_far_off():
    numbers = {"a": [1.0, 2.0], "b": [1.0, 4.0], "far": [60.0, 90.0], "control": [500.0]}
    # the highest of a, b and far are 2, 4 and 90: 2.5 times the median is 10
    assert axis_limits.colour_end(numbers, ["a", "b", "far"], 0.98) == 10.0
    assert axis_limits.colour_end(numbers, ["a", "b"], 1.0) == 4.0
    assert axis_limits.colour_end({}, [], 0.98) == 1.0


def test_names_of_marks_cover_neither_marks_nor_each_other():
    room = (0.0, 0.0, 200.0, 100.0)
    alone, left = (elements.names_beside([(x, 50.0)], ["name"], room)[0] for x in (50.0, 190.0))
    assert 'x="59"' in alone  # at the right of its mark
    assert 'x="156.2"' in left  # there is no room at the right: 190 - 9 - 4 * 6.2
    crowd = [(50.0 + 4.0 * k, 50.0) for k in range(9)]
    shown = elements.names_beside(crowd, ["a long name"] * 9, room)
    assert 1 <= len(shown) < 9
