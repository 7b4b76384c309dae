"""What the regression gate says: the order of its lines, exit statuses, and how far a number may move."""

import numpy as np
import pytest

from retarget_bench.verification.gate import report
from retarget_bench.verification.gate.compare import Change, Comparison, Status, Tolerance


def test_what_moved_comes_first_the_gravest_foremost_then_counts():
    changes = (
        Change(Status.UNMEASURED, why="no case"),
        *(Change(Status.FAILING, "m", f"v{n}", "intra", why="out of ideas") for n in range(60)),
        Change(Status.WORSE, "m|x", "v.one", "intra", 1.0, 2.0, "most <b>"),
        Change(Status.WORSE, "m|x", "v.two", "intra", 1.0, 1.5),
    )
    comparison = Comparison(changes, 70)
    text = report.text(comparison)
    at = [
        text.index(word)
        for word in (
            "could not measure",
            "newly failing",
            "v5",
            "worse",
            "and 54 more",
            "70 compared: 7 same",
        )
    ]
    assert at == sorted(at)
    assert "v6" not in text
    full_text = report.text(comparison, everything=True)
    assert "v59" in full_text
    assert "v.two" in full_text
    short = report.markdown(Comparison(changes[-2:], 70))
    (row,) = (line for line in short.splitlines() if line.startswith("| worse"))
    assert row == "| worse | m\\|x | v.one | intra | 1 | 2 | most &lt;b&gt;; and 1 like it |"


@pytest.mark.parametrize(
    ("statuses", "compared", "verdict"),
    [
        ([], 0, 2),
        ([], 1, 0),
        *(([each], 2, 1) for each in Status if each is not Status.UNMEASURED),
        ([Status.UNMEASURED, Status.WORSE], 5, 2),
    ],
)
def test_exit_statuses(statuses, compared, verdict):
    assert Comparison(tuple(Change(each, "x") for each in statuses), compared).verdict == verdict


@pytest.mark.parametrize(
    ("limit", "golden_", "now", "typical", "moved"),
    [
        (Tolerance(1e-3, 0.0), 1.0, 1.0009, 1.0, False),
        (Tolerance(1e-3, 0.0), 1.0, 1.0011, 1.0, True),
        (Tolerance(1e-9, 1e-3), 50.0, 50.04, 1.0, False),
        (Tolerance(1e-9, 1e-3), 50.0, 49.94, 1.0, True),
        (Tolerance(1e-3, 1e-3), 0.0, 9e-4, 0.0, False),
        (Tolerance(0.0, 1e-6), 0.0, 0.0, 0.0, False),
        (Tolerance(0.0, 1e-6), 0.0, 1e-12, 0.0, True),
        (Tolerance(0.0, 2e-2), 0.0, 0.9, 50.0, False),
        (Tolerance(0.0, 2e-2), 0.0, 1.1, 50.0, True),
    ],
)
def test_limits(limit, golden_, now, typical, moved):
    """A golden number of 0 is as large as is typical of its value."""
    assert limit.passed(np.array(golden_), np.array(now), typical) == moved
