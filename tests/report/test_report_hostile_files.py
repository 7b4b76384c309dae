"""Files, bodies and joints whose names break pages: in reports and tables they are text."""

from __future__ import annotations

import pytest

from retarget_bench.errors import printable
from tests.report import odd_folder
from tests.report.odd_runs import report
from tests.report.test_report_browser import sideways
from tests.viewing.viewing_toys.toy_moves import PERSON

JOINTS = PERSON | {
    "<script>alert(1)</script>": ("Head", (0, 0.1, 0)),
    "\"'&amp;</g>": ("LeftHand", (0.05, 0, 0)),
    "手": ("RightHand", (-0.05, 0, 0)),
    "j" * 300: ("Spine", (0, 0.05, -0.1)),
}
BODIES = {
    "<script>alert(2)<": JOINTS,
    'it\'s "q" &amp; {{7*7}}': PERSON,
    "Ünï 名 \u202eRTL\u202c مرحبا": JOINTS,
    "l" * 200: PERSON,
}
CLIPS = {"<img src=x onerror=alert(3)>": 6, "two  spaces \u202eRTL": 1, "w" * 200: 3}
FOLDER = "bvh <b>& co"


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """``runs`` on such a folder, and ``report.html`` of them."""
    root = tmp_path_factory.mktemp("hostile")
    odd_folder.write(root / FOLDER, BODIES, CLIPS)
    methods = ("copy_rotations", "odd_answers[does=raise]")
    odd_folder.ran(root / FOLDER, root / "runs", methods, ("intra", "cross"))
    report(root / "runs", "-o", root / "report.html", "--root", root / FOLDER)
    return root


@pytest.mark.parametrize("width", [390, 1200])
def test_a_browser_shows_them_and_runs_none(root, open_page, width):
    page = open_page(root / "report.html", width=width)
    page.wait_for_selector("#player canvas")
    page.on("dialog", lambda dialog: pytest.fail(f"a name was run: {dialog.message}"))
    page.locator("details").evaluate_all("all => all.forEach((each) => (each.open = true))")
    assert sideways(page) <= 0
    page.locator("#name").fill("onerror")
    assert page.locator("#cases tr").count() == len(BODIES) * (len(BODIES) - 1) * 2 // 3
    page.locator("#name").fill("")
    shown = page.inner_text("#cases")
    for name in (*map(printable, BODIES), *map(printable, CLIPS)):
        assert name in shown
    for button in page.locator("#cases button").all()[:3]:
        button.click()
        assert page.inner_text("#caption").startswith(("intra: ", "cross: "))
    for mark in page.locator("#chapter-1-joints .pick, #chapter-1-pairs .pick").all()[::12]:
        mark.dispatch_event("click")
        assert page.locator("#cases tr").count()
    assert sideways(page) <= 0
