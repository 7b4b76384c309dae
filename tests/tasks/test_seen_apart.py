"""Structures that training had and had not are drawn apart, for methods trained on some of them."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from retarget_bench import cli
from retarget_bench.analysis import seen_unseen
from retarget_bench.plugins import registry
from retarget_bench.results import store
from tests.engine.small_plans import asked
from tests.engine.stored import metadata
from tests.in_process import run_here

TOYS = Path(__file__).parent / "toys" / "toy_people.py"
LEARNED = {"denoise": "gaussian_filter", "joint-completion": "nearest_pose"}
PLAIN = {"denoise": "identity", "joint-completion": "linear_joints"}


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    """Two methods per task on two people, who are said to be of two structures; one method is said to have
    been trained on the first of them."""
    root = tmp_path_factory.mktemp("apart")
    registry.add_file(TOYS)
    for task, levels in (("denoise", "1,2,5"), ("joint-completion", "0.3,0.5,major")):
        about = {"splits": ("self",), "metrics": ("restoration",), "task": f"{task}[levels='{levels}']"}
        place, *_ = run_here(asked(root, LEARNED[task], PLAIN[task], data="toy_people[clips=3]", **about))
        metadata(place, structure=dict(zip(people(place), ("tall17", "wide17"), strict=True)))
        trained_on(root, task, ["tall17"])
    return root


def people(place: store.ResultPaths) -> list[str]:
    return sorted({info.target for info in store.read_cases(place.cases, place.task, place.split)})


def place_of(root: Path, task: str) -> store.ResultPaths:
    (place,) = (each for each in store.find_results(root, task) if each.method == LEARNED[task])
    return place


def trained_on(root: Path, task: str, structures: list[str] | None) -> None:
    """Say in the header of the learned method what its weights know."""
    path = place_of(root, task).header
    header = json.loads(path.read_text())
    header["method"]["trained_on"] = None if structures is None else {"structures": structures}
    path.write_text(json.dumps(header))


def plot(root: Path, task: str, output: Path, *more: str) -> int:
    with pytest.raises(SystemExit) as stop:
        cli.main(["plot", "levels", "--task", task, "-r", str(root), "-o", str(output), *more])
    return int(stop.value.code or 0)


def means(place: store.ResultPaths, target: str, value: str) -> dict[str, float]:
    """Level -> the mean over clips of what the file of rows says of one target."""
    numbers: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    clip_of = {info.id: info for info in store.read_cases(place.cases, place.task, place.split)}
    with place.rows.open(newline="") as file:
        for row in csv.DictReader(file):
            if row["value_id"] == value and clip_of[row["case"]].target == target:
                level = row["case"].rsplit("/", 1)[1]
                numbers[level][clip_of[row["case"]].clip].append(float(row["value"]))
    return {
        level: float(np.mean([np.mean(each) for each in clips.values()]))
        for level, clips in numbers.items()
    }


def drawn(panel, start: str):
    return [line for line in panel.lines if str(line.get_label()).startswith(start)]


def test_denoising_has_a_full_and_a_dashed_line_of_one_colour(results, tmp_path, figures):
    assert plot(results, "denoise", tmp_path / "out.svg") == 0
    panel, place = figures[0].axes[0], place_of(results, "denoise")
    seen, unseen = drawn(panel, "gaussian_filter")
    assert [seen.get_linestyle(), unseen.get_linestyle()] == ["-", "--"]
    assert seen.get_color() == unseen.get_color()
    assert [line.get_label() for line in (seen, unseen)] == [
        "gaussian_filter (seen: tall17)", "gaussian_filter (unseen: wide17)",
    ]  # fmt: skip
    for line, target in zip((seen, unseen), people(place), strict=True):
        before, after = (
            sorted(means(place, target, f"{word}_cm").values()) for word in ("given", "restored")
        )
        assert line.get_xdata() == pytest.approx(before, rel=1e-8)
        assert sorted(line.get_ydata()) == pytest.approx(after, rel=1e-8)
    assert drawn(panel, "identity") == []  # a control, not asked for
    texts = [*panel.texts, *(text for legend in figures[0].legends for text in legend.get_texts())]
    assert {seen.get_label(), unseen.get_label()} <= {text.get_text() for text in texts}


def test_upsampling_too_in_both_panels_with_a_mark_for_the_major_joints(results, tmp_path, figures):
    assert plot(results, "joint-completion", tmp_path / "out.svg", "--width", "column") == 0
    place = place_of(results, "joint-completion")
    for panel, value in zip(figures[0].axes, ("restored_cm", "restored_cm.missing"), strict=True):
        lines = drawn(panel, "nearest_pose")
        assert [line.get_linestyle() for line in lines] == ["-", "--"]
        marked = [line for line in panel.lines if line.get_marker() not in ("None", None)]
        majors = [line for line in marked if line.get_markersize() == 6]
        assert len(drawn(panel, "linear_joints")) == 1
        assert len(majors) == 3
        for line, major, target in zip(lines, majors[1:], people(place), strict=True):
            expected = means(place, target, value)
            (level,) = (each for each in expected if "major" in each)
            assert major.get_ydata() == pytest.approx([expected.pop(level)])
            assert sorted(line.get_ydata()) == pytest.approx(sorted(expected.values()))


@pytest.mark.parametrize("structures", [None, [], ["tall17", "wide17"], ["dog4"]])
def test_methods_that_know_all_or_nothing_have_one_line(results, tmp_path, structures):
    trained_on(results, "denoise", structures)
    try:
        assert seen_unseen.seen_and_unseen(store.find_results(results, "denoise"), "level") == []
    finally:
        trained_on(results, "denoise", ["tall17"])
