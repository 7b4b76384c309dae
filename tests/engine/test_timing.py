"""Speeds: measured once for a method, on one split, and shown on all."""

from pathlib import Path

import pytest
from small_plans import asked

from retarget_bench.analysis.summary import split_summaries
from retarget_bench.evaluation import runner, timing
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import builder

pytestmark = pytest.mark.usefixtures("in_process", "toys")

BOTH = ("intra", "cross")


def measured(root: Path, *splits: str, **changes) -> list[ResultPaths]:
    plan = asked(root, "toy_method", splits=splits, **changes)
    return runner.run(plan, lambda done, total: None, timed=True)


def test_the_speed_on_the_last_split_is_shown_on_all(tmp_path):
    intra, cross = measured(tmp_path, *BOTH)
    assert cross.timing.exists()
    assert not intra.timing.exists()
    first, second = (section.scores[0].fps for section in split_summaries([intra, cross]))
    assert first == second > 0


def test_speeds_are_measured_anew_where_results_are_newer(tmp_path, monkeypatch):
    monkeypatch.setattr(timing, "yardstick", lambda: 1.0)
    intra, cross = measured(tmp_path, *BOTH)
    before = cross.timing.stat().st_mtime_ns
    measured(tmp_path, *BOTH)
    measured(tmp_path, "intra")
    assert cross.timing.stat().st_mtime_ns == before
    measured(tmp_path, "intra", overwrite="always")
    assert intra.timing.exists()
    assert not cross.timing.exists()


def test_times_of_some_clips_alone(tmp_path):
    intra, cross = measured(tmp_path, *BOTH)
    times = {"toy/small>tall/clip 0": 1.0, "toy/small>tall/clip 1": 3.0, "unknown": 5.0}
    timing.write(cross, [timing.Time(case, 12, seconds, 1.0) for case, seconds in times.items()])
    assert [each.seconds for each in timing.read(intra, {"clip 1", "clip 7"})] == [3.0]
    assert [(each.frames, each.seconds) for each in timing.read(intra)] == [(12, 1.0), (12, 3.0), (12, 5.0)]
    assert timing.rate(timing.read(intra)) == 4.0


def test_a_busy_moment_is_timed_again_and_the_quietest_counts(tmp_path, monkeypatch):
    """The machine is busy after the first try, and so before the second, and quiet from then on."""
    marks = iter([1.0, 1.0, 4.0, *[1.0] * 40])
    monkeypatch.setattr(timing, "yardstick", lambda: next(marks))  # the first: of the moment of the run
    monkeypatch.setattr(timing, "ENOUGH_SECONDS", 0.5)
    (place,) = measured(tmp_path, "cross")
    times = timing.read(place)
    assert len(times) > 1
    assert {each.yardstick for each in times} == {1.0}


def test_times_of_a_machine_that_stays_busy_are_kept_with_the_pace(tmp_path, monkeypatch):
    marks = iter([1.0, 1.0, *[5.0 + number % 2 for number in range(60)]])
    monkeypatch.setattr(timing, "yardstick", lambda: next(marks))
    (place,) = measured(tmp_path, "cross")
    assert 5.0 <= timing.pace(timing.read(place)) <= 6.0


def test_a_quieter_moment_times_again_and_a_busier_one_does_not(tmp_path, monkeypatch):
    paces = []
    for pace in (3.0, 4.0, 1.0):
        monkeypatch.setattr(timing, "yardstick", lambda pace=pace: pace)
        (place,) = measured(tmp_path, "cross")
        paces.append(timing.pace(timing.read(place)))
    assert paces == [3.0, 3.0, 1.0]


def test_speeds_of_busier_moments_are_told_apart(tmp_path):
    plan = asked(tmp_path, "toy_method", "copy_rotations", "bone_directions", splits=("cross",))
    places = runner.run(plan, lambda done, total: None)
    for place, mark in zip(places, (0.002, 0.0029, 0.005), strict=True):
        timing.write(place, [timing.Time("x", 100, 2.0, mark)])
    (section,) = split_summaries(places)
    notes = {score.label: section.slower(score) for score in section.scores}
    assert [label for label, why in notes.items() if why] == ["bone_directions"]
    assert "2.5 times as slow as for the fastest" in notes["bone_directions"]
    (cells,) = builder.tables([section], ["fps"])
    assert any("2.5 times as slow" in sentence for sentence in cells.footnotes)
    (table,) = builder.tables([section])
    speed_notes = [line for line in table.notes if "50" in line]
    assert speed_notes == [
        "Speed in frames/s of one process and thread, with handing over: copy_rotations 50, toy_method 50.",
        f"Not comparable: bone_directions 50, {notes['bone_directions']}.",
    ]
