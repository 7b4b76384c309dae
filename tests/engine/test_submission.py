"""Submissions: made, filled in, checked, and shown together."""

from __future__ import annotations

import csv
import io
import json
import shutil
from pathlib import Path

import pytest
from stored import unchecked
from submitted import TOYS, bench, errors, filled_in, predictions, rewrite, some

from retarget_bench.errors import BenchError
from retarget_bench.evaluation import timing
from retarget_bench.exchange.submission.board import board
from retarget_bench.exchange.submission.checking import check
from retarget_bench.exchange.submission.making import make
from retarget_bench.exchange.submission.manifest import CARD_SECTIONS, read
from retarget_bench.results import store
from retarget_bench.tables.rendering import RENDERERS

pytestmark = pytest.mark.usefixtures("in_process")


def test_what_is_left_to_fill_in_is_found_and_nothing_else(made: Path, sound: Path) -> None:
    found = errors(made)
    assert len(found) == len(CARD_SECTIONS) + 2  # authors and licence
    assert check(sound) == []


def test_memory_is_measured_and_the_speed_is_that_of_the_results(sound: Path, runs: Path) -> None:
    cost = read(sound).cost
    (place,) = (p for p in store.find_results(runs) if (p.method, p.split) == ("ik", "cross"))
    assert cost.frames_per_second == float(f"{timing.rate(timing.read(place)):.3g}") > 100
    assert 0 <= cost.peak_memory_mb < 2000


def test_the_speed_is_measured_where_the_results_have_none(tmp_path: Path, runs: Path) -> None:
    shutil.copytree(runs, tmp_path / "runs", ignore=shutil.ignore_patterns("*.timing.csv"))
    make(tmp_path / "ik", tmp_path / "runs", "ik")
    assert read(tmp_path / "ik").cost.frames_per_second > 100


def test_every_mistake_in_the_manifest_is_said_at_once(sound: Path) -> None:
    rewrite(sound / "submission.toml", "parameters = 0", 'parameters = "none"')
    rewrite(sound / "submission.toml", "authors = ", "author = ")
    (said,) = errors(sound)
    assert "cost.parameters" in said
    assert "method.authors" in said
    assert "method.author:" in said


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("no manifest", "submission.toml: is missing"),
        ("newer", "Upgrade retarget-bench"),
        ("not toml", "is not TOML"),
        ("no card", "CARD.md cannot be read"),
        ("no rows", "neither results/ nor predictions/"),
        ("a case less", "cases are answered, the rows"),
        ("other label", "the rows are of ik, the manifest of mine"),
        ("hidden privilege", "which method.sees does not say"),
        ("other data", "made on other data"),
        ("not a number", "is not a number"),
        ("a stranger", "1 case unknown to the data set"),
        ("unknown data", "data.dataset"),
        ("header cut", "the header is not one: method lacks privileged"),
        ("undeclared", "does not say what mpjpe_h.world is"),
        ("a seed twice", "ik and ik.copy are both of seed 0"),
        ("not complete", "retarget intra: the results are not complete"),
    ],
)
def test_what_is_wrong_is_said(sound: Path, name: str, told: str) -> None:
    unchecked(sound)
    manifest, rows, header = (
        sound / "submission.toml",
        some(sound, "intra", ".csv"),
        some(sound, "intra", ".json"),
    )
    if name == "no manifest":
        manifest.unlink()
    elif name == "newer":
        rewrite(manifest, "schema = 1", "schema = 99")
    elif name == "not toml":
        manifest.write_text("schema = = 1")
    elif name == "no card":
        (sound / "CARD.md").unlink()
    elif name == "no rows":
        shutil.rmtree(sound / "results")
    elif name == "a case less":
        lines = rows.read_text().splitlines(keepends=True)
        first = lines[1].split(",")[0]
        rows.write_text("".join(line for line in lines if not line.startswith(first)))
    elif name == "header cut":
        facts = json.loads(header.read_text(encoding="utf-8"))
        del facts["method"]["privileged"], facts["dataset"]["content"], facts["counts"]["ok"]
        header.write_text(json.dumps(facts), encoding="utf-8")
    elif name == "undeclared":
        facts = json.loads(header.read_text(encoding="utf-8"))
        del facts["values"]["mpjpe_h.world"]
        header.write_text(json.dumps(facts), encoding="utf-8")
    elif name == "a seed twice":
        for path in (rows, header, rows.with_suffix(".npz")):
            shutil.copyfile(path, path.with_name(path.name.replace("ik.", "ik.copy.")))
    elif name == "not complete":
        shutil.copyfile(header, header.with_suffix(".begun"))
    elif name == "other label":
        rewrite(manifest, 'label = "ik"', 'label = "mine"')
    elif name == "hidden privilege":
        facts = json.loads(header.read_text())
        facts["method"]["privileged"] = ["reference"]
        header.write_text(json.dumps(facts))
    elif name == "other data":
        rewrite(header, "toy-1-3", "toy-1-2")
    elif name == "not a number":
        text = rows.read_text().splitlines()
        text[1] = text[1].rsplit(",", 1)[0] + ",nan"
        rows.write_text("\n".join(text) + "\n")
    elif name == "a stranger":
        (cases,) = sound.glob("results/*/retarget/intra/cases.csv")
        cases.write_text(cases.read_text() + "toy/small>tall/clip 9,small,tall,clip 9,wiggle,12\n")
    else:
        rewrite(manifest, 'dataset = "toy_cases"', 'dataset = "toy_csaes"')
    assert any(told in text for text in errors(sound)), errors(sound)


def test_predictions_alone_are_scored_to_the_same_rows(sound: Path, runs: Path) -> None:
    before = some(sound, "intra", ".csv").read_bytes()
    shutil.rmtree(sound / "results")
    predictions(runs, sound)
    assert check(sound) == []
    assert some(sound, "intra", ".csv").read_bytes() == before


def test_rows_that_the_predictions_do_not_give_are_found(sound: Path, runs: Path) -> None:
    predictions(runs, sound)
    assert check(sound) == []
    unchecked(sound)
    rows = some(sound, "cross", ".csv")
    table = list(csv.reader(io.StringIO(rows.read_text())))
    for row in table[1:]:
        if row[1] == "mpjpe_h.world":
            row[3] = f"{float(row[3]) * 0.9:.9g}"
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(table)
    rows.write_text(out.getvalue())
    assert any("scored again gives another mpjpe_h.world" in text for text in errors(sound))


def test_the_leaderboard_shows_quality_and_cost(sound: Path, runs: Path) -> None:
    root = sound.parent
    make(root / "copy", runs, "copy_rotations")
    filled_in(root / "copy")
    rewrite(root / "copy" / "submission.toml", 'lookahead_frames = "clip"', "lookahead_frames = 0")
    make(root / "unfinished", runs, "ik")
    (made,), left_out = board(root)
    assert [text for text in left_out if text.startswith("unfinished is left out")] == left_out != []
    group = next(group for group in made.groups if group.split == "intra")
    cells = {
        row.label: {c.id: cell for c, cell in zip(group.columns, row.cells, strict=True)}
        for row in group.rows
    }
    assert set(cells) == {"copy_rotations", "ik"}
    assert cells["ik"]["cost.lookahead_frames"].text == "clip"
    assert cells["copy_rotations"]["cost.lookahead_frames"].value == 0.0
    assert cells["ik"]["mpjpe_h.world"].value is not None
    page = RENDERERS["html"]([made])
    for words in ("parameters", "look-ahead", "A. Author", "unfinished is left out"):
        assert words in page


def test_the_command(sound: Path, runs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert bench("submit", str(sound), "--check") == 0
    assert "can be submitted" in capsys.readouterr().out
    rewrite(sound / "CARD.md", "## Limits", "## Limit")
    assert bench("submit", str(sound), "--check") == 1
    assert "'## Limits' is missing" in capsys.readouterr().out
    assert bench("submit", str(sound.parent), "--board", "-o", str(tmp_path / "b.html")) == 2
    assert "no submission is sound" in capsys.readouterr().err
    rewrite(sound / "CARD.md", "## Limit", "## Limits")
    assert bench("submit", str(sound.parent), "--board", "-o", str(tmp_path / "b.html")) == 0
    assert (tmp_path / "b.html").read_text().startswith("<!doctype html>")
    capsys.readouterr()
    wrong = {
        ("submit", str(sound)): "say one of",
        ("submit", str(tmp_path / "x"), "--check"): "is no folder",
        ("submit", str(sound), "--make", "ik", "--results", str(runs)): "not an empty folder",
        (
            "submit",
            str(tmp_path / "y"),
            "--make",
            "kk",
            "--results",
            str(runs),
        ): "there are copy_rotations, ik. --results names another folder",
        ("submit", str(tmp_path), "--board", "-o", "x.doc"): "ends in .html",
        ("submit", str(tmp_path), "--board"): "holds no submissions",
    }
    for arguments, told in wrong.items():
        assert bench(*arguments) == 2
        assert told in capsys.readouterr().err


def test_all_seeds_are_submitted_and_predictions_are_of_the_first(tmp_path: Path) -> None:
    """Predictions are those of one seed; the rows of another one are not what they give."""
    runs = tmp_path / "runs"
    plugins = [word for name in ("cases", "method") for word in ("--plugin", str(TOYS / f"toy_{name}.py"))]
    asked = ("toy_method[does=noise]", "--seeds", "3", "-d", "toy_cases", "-s", "intra", "--out", str(runs))
    assert bench("run", *asked, *plugins) == 0
    make(tmp_path / "all" / "one", runs, "toy_method[does=noise]")
    folder = filled_in(tmp_path / "all" / "one")
    headers = sorted(folder.glob("results/*/retarget/intra/*.json"))
    assert [json.loads(path.read_text())["seeds"] for path in headers] == [[0], [1], [2]]
    (folder / "predictions").mkdir()
    (stem,) = {path.name.removesuffix(".json") for path in headers if ".seed-" not in path.name}
    for path in runs.glob(f"*/retarget/intra/{stem}/*.npz"):
        shutil.copy(path, folder / "predictions")
    assert errors(folder) == []
    (made,), _ = board(folder.parent)
    (group,) = made.groups
    assert [row.label for row in group.rows] == ["toy_method[does=noise]"]
    assert any(cell.spread is not None for cell in group.rows[0].cells)


def test_what_belongs_to_the_rows_is_submitted_with_them(sound: Path, runs: Path) -> None:
    """Everything that stays of a run: all but predictions and features, which are disposable."""
    (folder,) = {path.parent for path in sound.glob("results/*/retarget/intra/ik.json")}
    (ran,) = {path.parent for path in runs.glob("*/retarget/intra/ik.json")}
    kept = [p for p in ran.iterdir() if p.is_file() and not p.name.startswith("copy_rotations")]
    kept = [path for path in kept if not path.name.endswith(".features.npz")]
    assert {"ik.sets.csv", "cases.parts.csv"} <= {path.name for path in kept}
    assert {path.name: path.read_bytes() for path in kept} == {
        path.name: path.read_bytes() for path in folder.iterdir()
    }


def test_results_of_two_data_sets_are_no_submission(tmp_path: Path, runs: Path) -> None:
    shutil.copytree(runs, tmp_path / "runs")
    (data,) = (path for path in (tmp_path / "runs").iterdir() if path.is_dir())
    shutil.copytree(data, tmp_path / "runs" / "another")
    assert len(store.find_results(tmp_path / "runs")) == 8
    with pytest.raises(
        BenchError, match=r"on several data sets: another \(toy_cases\), toy_cases\. .* name it: -d"
    ):
        make(tmp_path / "ik", tmp_path / "runs", "ik")
    make(tmp_path / "ik", tmp_path / "runs", "ik", "another")
    assert [path.name for path in (tmp_path / "ik" / "results").iterdir()] == ["another"]


def test_a_method_is_found_however_it_is_written(tmp_path: Path, runs: Path) -> None:
    make(tmp_path / "one", runs, "Copy rotations[root_rule=hip_height]")
    assert read(tmp_path / "one").method.label == "copy_rotations"


def test_paper_and_licence_are_copied_from_the_card(tmp_path: Path) -> None:
    text = (TOYS / "toy_method.py").read_text()
    told = 'summary="toy",\n            paper="Toys, 2026",\n            licence="MIT",'
    assert 'summary="toy",' in text
    plugin = tmp_path / "licensed_method.py"
    plugin.write_text(text.replace('summary="toy",', told).replace('"toy_method"', '"licensed_method"'))
    runs, plugins = tmp_path / "runs", ("--plugin", str(TOYS / "toy_cases.py"), "--plugin", str(plugin))
    asked = ("-d", "toy_cases", "-s", "intra", "-m", "position", "--out", str(runs))
    assert bench("run", "licensed_method", *asked, *plugins) == 0
    left = make(tmp_path / "made", runs, "licensed_method")
    about = read(tmp_path / "made").method
    assert (about.paper, about.licence) == ("Toys, 2026", "MIT")
    assert left[0] == "method.authors"


def test_results_that_are_not_complete_are_no_submission(tmp_path: Path) -> None:
    runs = str(tmp_path / "runs")
    asked = ("-d", "toy_cases", "-s", "intra", "-m", "position", "--out", runs)
    plugin = ("--plugin", str(TOYS / "toy_cases.py"))
    assert bench("run", "copy_rotations", "--limit", "1", *asked, *plugin) == 0
    with pytest.raises(
        BenchError, match=r"of copy_rotations on intra in .*runs are not complete; bench run without"
    ):
        make(tmp_path / "made", Path(runs), "copy_rotations")
    assert not (tmp_path / "made").exists()
    with pytest.raises(BenchError, match="has no results of 'ik'; there are copy_rotations"):
        make(tmp_path / "made", Path(runs), "ik")
