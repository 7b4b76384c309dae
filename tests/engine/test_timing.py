"""Speeds: measured once for a method, on one split, and shown on all."""

from pathlib import Path

import pytest
from small_plans import asked

from retarget_bench.analysis.summary import split_summaries
from retarget_bench.evaluation import runner, timing
from retarget_bench.plugins import registry
from retarget_bench.results.store import ResultPaths

pytestmark = pytest.mark.usefixtures("in_process")

TOYS = Path(__file__).parent / "toys"
BOTH = ("intra", "cross")


def measured(root: Path, *splits: str, **changes) -> list[ResultPaths]:
    for name in ("toy_cases", "toy_method"):
        registry.add_file(TOYS / f"{name}.py")
    plan = asked(root, "toy_method", splits=splits, **changes)
    return runner.run(plan, lambda done, total: None, timed=True)


def test_the_speed_on_the_last_split_is_shown_on_all(tmp_path):
    intra, cross = measured(tmp_path, *BOTH)
    assert cross.timing.exists()
    assert not intra.timing.exists()
    first, second = (section.scores[0].fps for section in split_summaries([intra, cross]))
    assert first == second > 0


def test_speeds_are_measured_anew_where_results_are_newer(tmp_path):
    intra, cross = measured(tmp_path, *BOTH)
    before = cross.timing.stat().st_mtime_ns
    measured(tmp_path, *BOTH)
    measured(tmp_path, "intra")
    assert cross.timing.stat().st_mtime_ns == before
    measured(tmp_path, "intra", redo="always")
    assert intra.timing.exists()
    assert not cross.timing.exists()


def test_times_of_some_clips_alone(tmp_path):
    intra, cross = measured(tmp_path, *BOTH)
    cross.timing.write_text(
        "case,frames,seconds\ntoy/small>tall/clip 0,12,1\ntoy/small>tall/clip 1,12,3\nunknown,12,5\n"
    )
    assert timing.read(intra, {"clip 1", "clip 7"}) == [(12, 3.0)]
    assert timing.read(intra) == [(12, 1.0), (12, 3.0), (12, 5.0)]
