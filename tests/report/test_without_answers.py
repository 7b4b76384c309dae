"""Results in which nothing was answered, or nearly so: shown as what they are, or told in a sentence."""

from __future__ import annotations

import json
import math

import pytest

from retarget_bench.errors import BenchError
from retarget_bench.figures import palette
from tests.report.odd_runs import bench, report
from tests.report.test_report import Tags
from tests.viewing import small_runs


@pytest.fixture(scope="module")
def failed(tmp_path_factory):
    """Results of two methods, neither of which answered anything."""
    root = tmp_path_factory.mktemp("failed")
    small_runs.ran(root, "raise", "nan")
    return root


def test_a_report_shows_the_sources_and_why_there_is_no_answer(failed, tmp_path, open_page):
    file = tmp_path / "failed.html"
    assert "with 2 cases in motion" in report(failed, "-o", file)
    tags = Tags(file.read_text(encoding="utf-8"))
    split = json.loads(tags.scripts["report-data"])["chapters"][0]["splits"][0]
    assert split["numbers"] == {"mpjpe_h.world": [[None, None]] * 2}
    assert "RuntimeError: out of ideas" in tags.text
    page = open_page(file)
    assert page.locator("#player .rp-canvas").count() == 1
    assert "2 cases, 2 with motion" in page.inner_text("#what")
    assert "out of ideas" in page.inner_text("#cases") + page.inner_text("#player")
    assert not page.locator("svg.chart").count()


@pytest.mark.parametrize("kind", ["pairs", "methods"])
def test_a_picture_of_nothing_is_not_drawn(failed, tmp_path, kind):
    with pytest.raises(BenchError, match=r"no method (of these results )?has|nobody is ranked"):
        bench("plot", kind, "-r", failed, "-o", tmp_path / "nothing.png")
    assert list(tmp_path.iterdir()) == []


def test_what_is_infinitely_far_off_has_the_darkest_shade():
    assert palette.shade(math.inf) == palette.shade(1.0) == palette.SHADES - 1
    assert palette.shade(0.0) == palette.shade(-1.0) == 0
