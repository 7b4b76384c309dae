"""Every number of every table leads to the cases behind it, in a browser."""

from __future__ import annotations

import pytest

from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.results import case_metadata, store
from tests.engine import stored
from tests.report.odd_runs import report

EMPTY = """() => {
  const found = { numbers: 0, nowhere: [] };
  for (const cell of document.querySelectorAll("table.results td")) {
    if (!/\\d/.test(cell.textContent) || cell.querySelector(".empty")) continue;
    found.numbers += 1;
    document.getElementById("what").textContent = "";
    cell.click();
    const listed = document.querySelectorAll("#cases tr").length;
    if (!document.getElementById("what").textContent || !listed) found.nowhere.push(cell.textContent);
  }
  return found;
}"""
"""Presses every cell with a number in it; which led to no case."""
STRUCTURES = {"b": "two_legs", "c": "four_legs"}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two methods on two structures, with values of sets; one answered half of the cases of c."""
    root = tmp_path_factory.mktemp("sets")
    for method, error, lost in (("near", 1.0, 0), ("far", 4.0, 3)):
        rows = [
            (f"a>{target}", f"c{k}", {"mpjpe_h.world": error + 0.1 * k, "ratio": 1 + 0.1 * k})
            for target in "bc"
            for k in range(6)
        ]
        answered = len(rows) - lost
        rows[answered:] = [(pair, clip, "unsupported") for pair, clip, _ in rows[answered:]]
        place = stored.store(root, "cross", method, rows)
        values = [
            SetValue("fid.structure", each, 300, 30, 12.5 * error, 10.0, 50.0, 8.25, "real", "net")
            for each in STRUCTURES.values()
        ]
        stored.with_sets(place, values)
    return root


def structures(root) -> None:
    stored.metadata(store.find_results(root)[0], structure=STRUCTURES)


def names(page) -> list[str]:
    return page.locator("#cases td:first-child > span").all_inner_texts()


def test_all_numbers_of_results_lead_to_cases(report_file, open_page):
    pressed = open_page(report_file, width=1200).evaluate(EMPTY)
    assert pressed["numbers"] > 10
    assert pressed["nowhere"] == []


def test_values_of_sets_lead_to_the_cases_of_the_set(runs, tmp_path, open_page):
    structures(runs)
    report(runs, "-o", tmp_path / "r.html", "--clips", "0")
    page = open_page(tmp_path / "r.html", width=1200)
    table = page.locator("table[data-structure=four_legs]")
    table.locator("tr[data-row=near] .num").first.click()
    assert names(page) == [f"c{k}: a to c" for k in (5, 4, 3, 2, 1, 0)]
    assert page.inner_text("#what").startswith("cross, near, structure four_legs: 6 cases")
    assert "compared with the right answers to them (the reference)" in page.inner_text("#why")
    assert page.evaluate(EMPTY)["nowhere"] == []


def test_sets_of_results_that_do_not_say_which_bodies_they_are_of_lead_to_all_cases(
    runs, tmp_path, open_page
):
    case_metadata.path_of(store.find_results(runs)[0]).unlink(missing_ok=True)
    report(runs, "-o", tmp_path / "r.html", "--clips", "0")
    page = open_page(tmp_path / "r.html", width=1200)
    page.locator("table[data-structure=two_legs] tr[data-row=near] .num").first.click()
    assert len(names(page)) == 12
    assert "Which cases are of structure two_legs is not in this page" in page.inner_text("#why")


def test_counts_lead_to_what_is_counted(runs, tmp_path, open_page):
    report(runs, "-o", tmp_path / "r.html", "--clips", "0")
    page = open_page(tmp_path / "r.html", width=1200)
    table = page.locator("main table.results:not([data-structure])")
    table.locator("tr[data-row=far] .num").last.click()
    assert names(page)[:3] == [f"c{k}: a to c" for k in (3, 4, 5)]  # unanswered ones first
    assert len(names(page)) == 12
    page.locator("main summary", has_text="Cases without an answer").click()
    page.locator(".problems .num").click()
    assert names(page) == [f"c{k}: a to c" for k in (3, 4, 5)]
    assert "unsupported: because | of it" in page.inner_text("#cases")


def test_cases_that_means_leave_out_are_told_and_common_ones_are_listed(tmp_path, open_page):
    for method, count in (("all", 40), ("most", 39)):
        rows = [("a>b", f"c{k:02}", {"mpjpe_h.world": 1.0 + k} if k < count else {}) for k in range(40)]
        stored.store(tmp_path / "runs", "intra", method, rows)
    report(tmp_path / "runs", "-o", tmp_path / "r.html", "--clips", "0")
    page = open_page(tmp_path / "r.html", width=1200)
    page.locator("main tr[data-row=all] .num").first.click()
    left_out = page.locator("#cases tr", has_text="not in the means").all_inner_texts()
    assert [each.split(":")[0] for each in left_out] == ["c39"]
    page.locator("tfoot .num").first.click()
    assert names(page) == [f"c{k:02}: a to b" for k in range(38, -1, -1)]
