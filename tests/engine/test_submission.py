"""Submissions: made, filled in, checked, and shown together."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from stored import unchecked
from submitted import TOYS, bench, errors, filled_in, make, rewrite, some

from retarget_bench.evaluation import timing
from retarget_bench.exchange.card import CARD, read
from retarget_bench.exchange.checking import check
from retarget_bench.exchange.leaderboard import COSTS, leaderboard
from retarget_bench.results import store
from retarget_bench.tables.rendering import RENDERERS

pytestmark = pytest.mark.usefixtures("in_process")


def test_what_is_left_to_fill_in_is_found_and_nothing_else(unfilled: Path, sound: Path) -> None:
    (error,) = errors(unfilled)
    left = ["authors", "licence", "training", "limits"]
    costs = ["parameters", "training_hours", "peak_memory_mb", "lookahead_frames"]
    assert error.endswith(f"card.toml: is still to be filled in: {', '.join(left + costs)}")
    assert check(sound) == ([], [])


def test_the_speed_is_that_of_the_results(tmp_path: Path, sound: Path, runs: Path) -> None:
    (place,) = (p for p in store.find_results(runs) if (p.method, p.split) == ("ik", "cross"))
    assert read(sound).frames_per_second == float(f"{timing.rate(timing.read(place)):.3g}") > 100
    shutil.copytree(runs, tmp_path / "runs", ignore=shutil.ignore_patterns("*.timing.csv"))
    (error,) = errors(make(tmp_path / "ik", tmp_path / "runs", "ik"))
    assert error.endswith(", frames_per_second")


def test_every_mistake_in_the_card_is_said_at_once(sound: Path) -> None:
    rewrite(sound / CARD, "parameters = 0", 'parameters = "none"')
    rewrite(sound / CARD, "authors = ", "author = ")
    (error,) = errors(sound)
    for field in ("parameters", "authors", "author"):
        assert f" {field}: " in error


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("no card", "card.toml: is missing"),
        ("newer", "Upgrade retarget-bench"),
        ("no rows", "holds no results beside its card.toml"),
        ("a case less", "clip 0 has no numbers, though the header says"),
        ("a case unanswered", "the counts of its header are not those of its cases"),
        ("other label", "the rows are of ik, mine on toy_cases; a submission is of one method"),
        ("a control", "a control cannot be submitted"),
        ("other data", "made on other data (toy-1-2) than toy_cases has here (toy-1-3)"),
        ("two data sets", "of ik on bows, toy_cases; a submission"),
        ("undeclared", "does not say what mpjpe_h.world is"),
        ("a seed twice", "retarget intra: two results are of this seed"),
        ("not complete", "retarget intra: the results are not complete"),
    ],
)
def test_what_is_wrong_is_said(sound: Path, name: str, message: str) -> None:
    unchecked(sound)
    rows, header = some(sound, "intra", ".csv"), some(sound, "intra", ".json")
    facts = json.loads(header.read_text(encoding="utf-8"))
    if name == "no card":
        (sound / CARD).unlink()
    elif name == "newer":
        header.write_text(json.dumps(facts | {"schema": 99}), encoding="utf-8")
    elif name == "no rows":
        shutil.rmtree(header.parents[2])
    elif name == "a case less":
        lines = rows.read_text().splitlines(keepends=True)
        first = lines[1].split(",")[0]
        rows.write_text("".join(line for line in lines if not line.startswith(first)))
    elif name == "a case unanswered":
        problem = {
            "status": "failed",
            "message": "",
            "cases": [rows.read_text().splitlines()[1].split(",")[0]],
        }
        header.write_text(json.dumps(facts | {"problems": [problem]}), encoding="utf-8")
    elif name == "undeclared":
        del facts["values"]["mpjpe_h.world"]
        header.write_text(json.dumps(facts), encoding="utf-8")
    elif name == "a seed twice":
        for path in (rows, header, rows.with_suffix(".npz")):
            shutil.copyfile(path, path.with_name(path.name.replace("ik.", "ik.copy.")))
    elif name == "not complete":
        shutil.copyfile(header, header.with_suffix(".begun"))
    elif name == "other label":
        rewrite(header, '"label": "ik"', '"label": "mine"')
    elif name == "a control":
        rewrite(header, '"control": false', '"control": true')
    elif name == "other data":
        rewrite(header, "toy-1-3", "toy-1-2")
    else:
        rewrite(header, '"name": "toy_cases"', '"name": "bows"')
    assert any(message in text for text in errors(sound)), errors(sound)


def test_predictions_made_elsewhere_are_submitted_by_their_scores(tmp_path: Path, runs: Path) -> None:
    """The rows are those of the method that made them."""
    (tmp_path / "theirs").mkdir()
    for path in runs.glob("*/retarget/*/ik/*.npz"):
        shutil.copy(path, tmp_path / "theirs")
    options = ("--name", "theirs", "-d", "toy_cases", "--out", str(tmp_path / "scored"))
    assert bench("score", str(tmp_path / "theirs"), *options) == 0
    folder = make(tmp_path / "made", tmp_path / "scored", "theirs")
    filled_in(folder)
    assert errors(folder) == []
    paths = list(folder.glob("*/retarget/*/theirs.csv"))
    assert len(paths) == 2
    for path in paths:
        (own,) = runs.glob(f"*/retarget/{path.parent.name}/ik.csv")
        assert path.read_bytes() == own.read_bytes()


def test_the_leaderboard_shows_quality_and_cost(sound: Path, runs: Path) -> None:
    root = sound.parent
    filled_in(make(root / "copy", runs, "copy_rotations"))
    rewrite(root / "copy" / CARD, 'lookahead_frames = "clip"', "lookahead_frames = 0")
    rewrite(root / "copy" / CARD, "parameters = 0", "parameters = 1234567")
    make(root / "unfinished", runs, "ik")
    (table, cost), left_out = leaderboard(root)
    assert [text for text in left_out if text.startswith("unfinished is left out")] == left_out != []
    group = next(group for group in table.groups if group.split == "intra")
    shown = {row.label: dict(zip(group.columns, row.cells, strict=True)) for row in group.rows}
    assert set(shown) == {"copy_rotations", "ik"}
    assert all(
        cell.value is not None
        for cells in shown.values()
        for column, cell in cells.items()
        if column.id == "mpjpe_h.world"
    )
    (copied, ik) = cost.groups[0].rows
    costs = {column.id: cell for column, cell in zip(COSTS, copied.cells, strict=True)}
    assert (copied.label, costs["lookahead_frames"].value) == ("copy_rotations", 0.0)
    assert costs["parameters"].text == "1,234,567"
    assert [
        cell.text for column, cell in zip(COSTS, ik.cells, strict=True) if column.id == "lookahead_frames"
    ] == ["clip"]
    for form, render in RENDERERS.items():
        page = render([table, cost])
        for words in ("parameters", "look-ahead") if form != "csv" else ("parameters", "inf"):
            assert words in page, form
    for words in ("A. Author", "unfinished is left out"):
        assert words in RENDERERS["html"]([table, cost])


def test_the_command(sound: Path, runs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert bench("submit", str(sound), "--check") == 0
    assert "can be submitted" in capsys.readouterr().out
    rewrite(sound / CARD, "limits", "limit")
    assert bench("submit", str(sound), "--check") == 1
    assert "limits: Field required" in capsys.readouterr().out
    assert bench("submit", str(sound.parent), "--board", "-o", str(tmp_path / "b.html")) == 2
    assert "no submission is sound" in capsys.readouterr().err
    rewrite(sound / CARD, "limit", "limits")
    assert bench("submit", str(sound.parent), "--board", "-o", str(tmp_path / "b.html")) == 0
    assert (tmp_path / "b.html").read_text().startswith("<!doctype html>")
    capsys.readouterr()
    wrong = {
        ("submit", str(sound)): "say one of",
        ("submit", str(tmp_path / "x"), "--check"): "is not a folder",
        ("submit", str(sound), "--make", "ik", "--results", str(runs)): "not an empty folder",
        (
            "submit",
            str(tmp_path / "y"),
            "--make",
            "kk",
            "--results",
            str(runs),
        ): "did you mean ik?",
        ("submit", str(tmp_path), "--board", "-o", "x.doc"): "ends in .html",
        ("submit", str(tmp_path), "--board"): "holds no submissions",
    }
    for arguments, message in wrong.items():
        assert bench(*arguments) == 2
        assert message in capsys.readouterr().err


def test_all_seeds_are_submitted_with_the_predictions_of_each(tmp_path: Path) -> None:
    """Predictions are those of one seed; the rows of another one are not what they give."""
    runs = tmp_path / "runs"
    method, data = f"{TOYS / 'toy_method.py'}[does=noise]", str(TOYS / "toy_cases.py")
    assert bench("run", method, "--seeds", "3", "-d", data, "-s", "intra", "--out", str(runs)) == 0
    folder = filled_in(make(tmp_path / "all" / "one", runs, "toy_method[does=noise]"))
    headers = sorted(folder.glob("*/retarget/intra/*.json"))
    assert [json.loads(path.read_text())["seeds"] for path in headers] == [[0], [1], [2]]
    stored = [path for path in headers[0].parent.iterdir() if path.is_dir()]
    assert len(stored) == 3
    assert errors(folder) == []
    (table, _), _ = leaderboard(folder.parent)
    (group,) = table.groups
    assert [row.label for row in group.rows] == ["toy_method[does=noise]"]
    assert any(cell.spread is not None for cell in group.rows[0].cells)
    one, other = stored[:2]
    shutil.rmtree(one)
    other.rename(one)
    assert any("scored again" in text for text in errors(folder))


def test_results_of_two_data_sets_are_no_submission(
    tmp_path: Path, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(runs, tmp_path / "runs")
    (data,) = (path for path in (tmp_path / "runs").iterdir() if path.is_dir())
    shutil.copytree(data, tmp_path / "runs" / "another")
    assert len(store.find_results(tmp_path / "runs")) == 8
    assert bench("submit", str(tmp_path / "ik"), "--make", "ik", "--results", str(tmp_path / "runs")) == 2
    output = " ".join(capsys.readouterr().err.split())
    assert "on several data sets: another (toy_cases), toy_cases." in output
    assert "name it: -d" in output
    make(tmp_path / "ik", tmp_path / "runs", "ik", "-d", "another")
    assert {path.name for path in (tmp_path / "ik").iterdir()} == {"another", CARD}


def test_paper_and_licence_are_copied_from_the_card(tmp_path: Path) -> None:
    text = (TOYS / "toy_method.py").read_text()
    fields = 'summary="toy",\n            paper="Toys, 2026",\n            licence="MIT",'
    assert 'summary="toy",' in text
    plugin = tmp_path / "licensed_method.py"
    plugin.write_text(text.replace('summary="toy",', fields).replace('"toy_method"', '"licensed_method"'))
    runs = tmp_path / "runs"
    options = ("-d", str(TOYS / "toy_cases.py"), "-s", "intra", "--metrics", "position", "--out", str(runs))
    assert bench("run", str(plugin), *options) == 0
    card = read(filled_in(make(tmp_path / "made", runs, "licensed_method")))
    assert (card.paper, card.licence, card.authors) == ("Toys, 2026", "MIT", ["A. Author"])


def test_a_method_is_found_however_it_is_written(tmp_path: Path, runs: Path) -> None:
    folder = make(tmp_path / "one", runs, "Copy rotations[root_rule=hip_height]")
    headers = [store.read_header(place.header) for place in store.find_results(folder)]
    assert {header.method.label for header in headers} == {"copy_rotations"}
