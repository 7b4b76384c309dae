"""What the regression gate says: the order of its lines, exit statuses, and how far a number may move."""

import re

import pytest

from retarget_bench.verification.gate import compare, report
from retarget_bench.verification.gate.compare import GateRow, Status, Tolerance

RED = (Status.FAILING, Status.WORSE, Status.BETTER, Status.MOVED, Status.INCOMPARABLE)


def test_what_moved_comes_first_the_gravest_foremost_then_counts():
    lines = [
        GateRow(Status.UNMEASURED, "", why="no case"),
        *(GateRow(Status.FAILING, "m", "intra", f"v{n}", why="out of ideas") for n in range(9)),
        GateRow(Status.WORSE, "m|x", "intra", "v", "1", 1.0, 2.0, 9.0, "most <b>"),
        *(GateRow(Status.MOVED, "frozen motions", f"f{n}", "w", "m", 0.0, 1.0, 2.0) for n in range(40)),
        *(GateRow(Status.SAME, "m", "intra", f"s{n}") for n in range(5)),
    ]
    said = report.text(lines, 2)
    at = [
        said.index(word)
        for word in ("could not measure:", "newly failing:", "worse:", "moved:", "56 rows: 5 same")
    ]
    assert at == sorted(at)
    assert said.count("\n  frozen motions") == 1
    assert "f2 0 -> 1, and 37 more m  (40 rows" in said
    assert re.search(r"newly failing:\n  m  intra  9 rows  \(out of ideas\)", said)
    assert "f39" in report.text(lines, 2, everything=True)
    written = report.markdown(lines, 2)
    assert "`m\\|x`" in written
    assert "&lt;b&gt;" in written


@pytest.mark.parametrize(
    ("marks", "status"),
    [
        ([], 2),
        ([Status.SAME], 0),
        ([Status.SAME, Status.NO_WORSE], 0),
        *(([Status.SAME, mark], 1) for mark in RED),
        ([Status.UNMEASURED, Status.WORSE], 2),
    ],
)
def test_exit_statuses(marks, status):
    assert compare.verdict([GateRow(mark, "x") for mark in marks]) == status


@pytest.mark.parametrize(
    ("limit", "golden_", "now", "moved"),
    [
        (Tolerance(1e-3, 0.0), 1.0, 1.0009, False),
        (Tolerance(1e-3, 0.0), 1.0, 1.0011, True),
        (Tolerance(1e-9, 1e-3), 50.0, 50.04, False),
        (Tolerance(1e-9, 1e-3), 50.0, 49.94, True),
        (Tolerance(1e-3, 1e-3), 0.0, 9e-4, False),
        (Tolerance(0.0, 1e-6), 0.0, 0.0, False),
        (Tolerance(0.0, 1e-6), 0.0, 1e-12, True),
    ],
)
def test_limits(limit, golden_, now, moved):
    assert (limit.ratio(golden_, now) > 1) == moved
