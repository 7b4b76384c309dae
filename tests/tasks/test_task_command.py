"""``bench run --task`` from end to end on toy people: rows, levels, tables, pictures, resuming."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.analysis import summary
from retarget_bench.cli import main
from retarget_bench.evaluation import runner
from retarget_bench.plugins import registry
from retarget_bench.results import store
from tests.engine.small_plans import asked
from tests.in_process import without_processes

TOYS = Path(__file__).parent / "toys" / "toy_people.py"
CHI3 = 2 * np.sqrt(2 / np.pi)
METRICS = ("restoration", "smoothness")


def carried_out(root: Path, task: str, *methods: str, **changes) -> list[store.Results]:
    registry.add_file(TOYS)
    data = "toy_people[clips=6]"
    plan = asked(root, *methods, data=data, splits=("self",), metrics=METRICS, task=task, **changes)
    return [store.read_results(place) for place in runner.run(plan, lambda done, total: None)]


def bench(capsys, *arguments: str) -> tuple[int, str]:
    with pytest.raises(SystemExit) as stopped:
        main(list(arguments))
    output = capsys.readouterr()
    return int(stopped.value.code or 0), output.out + output.err


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    """Two tasks with a few methods each."""
    root = tmp_path_factory.mktemp("tasks")
    with without_processes():
        carried_out(root, "denoise[levels='0,2,5']", "identity", "gaussian_filter", "copy_rotations")
        carried_out(
            root, "joint-completion[levels='0.5,1,major']", "linear_joints", "nearest_pose", "identity"
        )
        carried_out(root, "reconstruct", "identity", "copy_rotations", "pan")
    return root


def rows(root: Path, task: str, method: str) -> store.Results:
    (place,) = (each for each in store.find_results(root, task) if each.method == method)
    return store.read_results(place)


def test_doing_nothing_scores_the_noise_before_and_after(results):
    identity = rows(results, "denoise", "identity")
    by_level: dict[str, list[float]] = {}
    for entry in identity.entries:
        assert entry.values["restored_cm"] == pytest.approx(entry.values["given_cm"], abs=1e-4)
        by_level.setdefault(entry.case.rsplit("/", 1)[1], []).append(entry.values["given_cm"])
    assert {level: len(each) for level, each in by_level.items()} == {
        "noise-0cm": 12, "noise-2cm": 12, "noise-5cm": 12,
    }  # fmt: skip
    assert max(by_level["noise-0cm"]) < 1e-4
    for level, sigma in (("noise-2cm", 2.0), ("noise-5cm", 5.0)):
        lengths = 12 * 40 * 17
        assert np.mean(by_level[level]) == pytest.approx(CHI3 * sigma, rel=4 * 0.422 / np.sqrt(lengths))


def test_all_joints_given_leave_no_error_and_missing_ones_are_told_apart(results):
    for name in ("linear_joints", "nearest_pose"):
        for entry in rows(results, "joint-completion", name).entries:
            values = entry.values
            if entry.case.endswith("joints-1"):
                assert values["restored_cm"] < 1e-4
                assert "restored_cm.missing" not in values
            else:
                share = (12 if entry.case.endswith("major") else 8) / 16
                assert values["restored_cm.given"] < 1e-4
                assert values["restored_cm"] == pytest.approx(
                    (1 - share) * values["restored_cm.missing"], abs=1e-4
                )
    nothing = {e.case: e.status for e in rows(results, "joint-completion", "identity").entries}
    assert {case for case, status in nothing.items() if status == "ok"} == {
        case for case in nothing if case.endswith("joints-1")
    }


def test_conditions_and_structures_lie_beside_the_rows(results):
    (folder,) = {place.folder for place in store.find_results(results, "joint-completion")}
    with (folder / "cases.metadata.csv").open(encoding="utf-8", newline="") as file:
        facts = list(csv.DictReader(file))
    conditions = {
        (row["of"], row["index"]): float(row["value"]) for row in facts if row["fact"] == "condition"
    }
    case = "people/ann>ann/clip 3"
    assert conditions[f"{case}/joints-0.5", "proportion"] == 0.5
    assert (conditions[f"{case}/joints-0.5", "joints"], conditions[f"{case}/joints-0.5", "of"]) == (8, 16)
    assert conditions[f"{case}/joints-major", "major"] == 1
    structures = {row["of"]: row["value"] for row in facts if row["fact"] == "structure"}
    assert structures == {"ann": "toy17", "bob": "toy17"}


def test_the_command_shows_a_line_per_level(tmp_path, capsys):
    arguments = ("identity", "savitzky_golay", "-d", str(TOYS), "-j", "1", "--out", str(tmp_path))
    with without_processes():
        status, output = bench(capsys, "run", "--task", 'denoise[levels="1,0",motions=2]', *arguments)
    assert status == 0
    assert "position error ↓ in cm, by level" in output
    assert "0 cm" in output
    assert "(control)" in output
    assert "savitzky_golay" in output
    status, again = bench(capsys, "table", "-r", str(tmp_path), "--task", "denoise", "-f", "csv")
    assert status == 0
    assert "level" in again.splitlines()[0]
    status, output = bench(capsys, "table", "-r", str(tmp_path))
    assert (status, "no results in" in output) == (2, True)


def test_table_2_has_the_printed_numbers_and_our_structures(results, capsys):
    status, output = bench(capsys, "table", "-r", str(results), "--paper", "humot-table2")
    assert status == 0
    assert "1.75 ±0.48" in output
    assert "toy17" in output
    assert "the method is untrained" in " ".join(output.split())
    assert "pan: trained on structures none; new to it: toy17." in output


# -------------------------------------------------------------------------------------------- pictures
def line_of(panel, label: str) -> np.ndarray:
    (drawn_line,) = (line for line in panel.lines if line.get_label() == label)
    return np.array(drawn_line.get_xydata())


@pytest.mark.filterwarnings("error::UserWarning")
def test_clean_motion_alone_has_a_picture_too(tmp_path, capsys, figures):
    carried_out(tmp_path, "denoise[levels=0]", "identity")
    status, _ = bench(capsys, "plot", "levels", "-r", str(tmp_path), "-o", str(tmp_path / "out.png"))
    assert status == 0
    assert line_of(figures[0].axes[0], "identity (control)") == pytest.approx(np.zeros((1, 2)), abs=1e-3)


def test_pictures_of_several_sets_of_levels_say_how_to_choose(tmp_path, capsys):
    for levels in ("0", "1"):
        carried_out(tmp_path, f"denoise[levels={levels}]", "identity")
    status, output = bench(capsys, "plot", "levels", "-r", str(tmp_path), "-o", str(tmp_path / "out.png"))
    assert status == 2
    assert "run the one to draw with an --out of its own" in output


@pytest.mark.parametrize("task", ["denoise", "joint-completion"])
def test_pictures_without_results_say_how_to_make_some(tmp_path, capsys, task):
    drawn = ("plot", "levels", "--task", task, "-r", str(tmp_path), "-o")
    status, output = bench(capsys, *drawn, str(tmp_path / "out.png"))
    assert status == 2
    assert f"bench run --task {task} makes some" in output
    status, output = bench(capsys, *drawn, str(tmp_path / "out.doc"))
    assert (status, ".png, .pdf, .svg" in output) == (2, True)


def test_levels_stand_in_their_order(results):
    for task, parts in (
        ("denoise", ["0 cm", "2 cm", "5 cm"]),
        ("joint-completion", ["50 %", "100 %", "major"]),
    ):
        sections = summary.split_summaries(store.find_results(results, task), "level")
        assert [section.part for section in sections] == parts
