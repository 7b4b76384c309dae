"""Colours and columns of reports: the same as in pictures, and as asked for."""

from __future__ import annotations

import json

import pytest

from retarget_bench.errors import BenchError
from retarget_bench.figures import method_order
from retarget_bench.figures.palette import COLOURS
from retarget_bench.report import chapters, index
from tests.engine import stored
from tests.report.odd_runs import bench, report
from tests.report.test_report import Tags

ERRORS = {"alpha": 9.0, "beta": 1.0, "gamma": 5.0}
"""Alphabetical order is not that of ranks."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    root = tmp_path_factory.mktemp("ranked")
    for method, error in ERRORS.items():
        for split in ("intra", "cross"):
            rows = [
                ("a>b", f"c{k}", {"mpjpe_h.world": error + 0.1 * k, "ratio": 20 - error}) for k in range(12)
            ]
            stored.store(root, split, method, rows)
    return root


def data_of(file) -> dict:
    return json.loads(Tags(file.read_text(encoding="utf-8")).scripts["report-data"])


def test_a_method_has_one_colour_in_reports_and_pictures_whoever_stands_beside_it(runs, tmp_path, figures):
    report(runs, "-o", tmp_path / "all.html", "--clips", "0")
    colours = data_of(tmp_path / "all.html")["colours"]
    assert colours == dict(zip(("beta", "gamma", "alpha"), COLOURS, strict=False))
    report(runs, "-o", tmp_path / "one.html", "--clips", "0", "-m", "alpha")
    assert data_of(tmp_path / "one.html")["colours"] == {"alpha": COLOURS[2]}
    bench(
        "plot", "methods", "-r", runs, "-m", "alpha", "-m", "gamma", "-s", "cross", "-o", tmp_path / "t.svg"
    )
    (axes,) = figures[0].axes
    names = [text.get_text() for text in axes.get_yticklabels()]
    marks = [line for line in axes.lines if line.get_marker() not in ("None", "")]
    drawn = {name: line.get_color() for name, line in zip(names, marks, strict=True)}
    assert drawn == {"alpha": colours["alpha"], "gamma": colours["gamma"]}


def test_methods_of_later_tables_come_after_those_of_the_first(runs):
    places = chapters.results([runs])
    assert list(method_order.ranked(places)) == ["beta", "gamma", "alpha"]
    assert list(method_order.ranked([place for place in places if place.method != "beta"])) == [
        "gamma",
        "alpha",
    ]


def test_columns_are_those_asked_for_and_the_first_one_ranks(runs, tmp_path):
    report(runs, "-o", tmp_path / "c.html", "--clips", "0", "--columns", "ratio")
    split = data_of(tmp_path / "c.html")["chapters"][0]["splits"][0]
    assert [value["id"] for value in split["values"]] == ["ratio"]
    with pytest.raises(BenchError, match="value 'rato'; did you mean ratio"):
        report(runs, "-o", tmp_path / "d.html", "--columns", "rato")
    assert not (tmp_path / "d.html").exists()


def test_of_very_many_cases_the_worst_are_listed(runs, tmp_path, monkeypatch, open_page):
    monkeypatch.setattr(index, "LISTED", 5)
    file = tmp_path / "some.html"
    report(runs, "-o", file, "--clips", "0", "--columns", "mpjpe_h.world,ratio")
    tags = Tags(file.read_text(encoding="utf-8"))
    assert "Of splits with more than 5 cases the worst of every method" in tags.text
    split = data_of(file)["chapters"][0]["splits"][0]
    assert sorted(case["clip"] for case in split["cases"]) == ["c0", "c10", "c11", "c8", "c9"]
    page = open_page(file)
    assert told(page) == pytest.approx([ERRORS["beta"] + 0.1 * k for k in (11, 10, 9, 8, 0)])
    lost = page.locator(".pick").evaluate_all(
        """all => all.filter((each) => {
          each.dispatchEvent(new MouseEvent("click", { bubbles: true }));
          return !document.querySelectorAll("#cases tr").length;
        }).length"""
    )
    assert lost == 0


def told(page) -> list[float]:
    """The numbers in the list of cases."""
    return [float(each) for each in page.locator("#cases td:last-child").all_inner_texts()]
