"""Runs of some clips: never taken for whole ones, and gone on from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from small_plans import asked

from retarget_bench.analysis.selection import Selection
from retarget_bench.analysis.summary import split_summaries
from retarget_bench.api import CaseInfo
from retarget_bench.cli import main
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import runner, timing
from retarget_bench.evaluation.quick_looks import chosen
from retarget_bench.plugins import registry
from retarget_bench.results import store

pytestmark = pytest.mark.usefixtures("in_process")

HERE = Path(__file__).parent
VALUE = "mpjpe_h.world"


@pytest.fixture(autouse=True)
def _toys() -> None:
    for file in sorted((HERE / "toys").glob("*.py")):
        registry.add_file(file)


def run(root: Path, *methods: str, timed: bool = False, **changes) -> list[store.ResultPaths]:
    limits = {name: changes.pop(name) for name in ("clips", "limit") if name in changes}
    plan = replace(asked(root, *(methods or ("toy_method",)), clips=5, **changes), **limits)
    return runner.run(plan, lambda done, total: None, timed=timed)


def files(root: Path) -> dict[str, bytes]:
    """What a run leaves, but headers, which hold dates and times."""
    found = (path for path in root.rglob("*") if path.is_file() and path.suffix in (".csv", ".npz"))
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in found}


def table(capsys, *arguments: object) -> str:
    with pytest.raises(SystemExit) as stop:
        main(list(map(str, arguments)))
    assert not stop.value.code
    return capsys.readouterr().out


def infos(*clips: str) -> list[CaseInfo]:
    return [
        CaseInfo(f"{pair}/{c}", "retarget", "cross", *pair, c, "") for pair in ("ab", "ba") for c in clips
    ]


@pytest.mark.parametrize(
    ("patterns", "limit", "kept"),
    [
        ((), 2, {"walk", "Run [fast]"}),
        ((), 9, {"walk", "walk back", "Run [fast]", "jump"}),
        (("WALK*",), 0, {"walk", "walk back"}),
        (("walk*",), 1, {"walk"}),
        (("run [fast]", "jum?"), 0, {"Run [fast]", "jump"}),
        (("nothing",), 0, set()),
    ],
)
def test_clips_are_chosen_with_all_their_pairs(patterns, limit, kept):
    found = chosen(infos("walk", "walk back", "Run [fast]", "jump"), patterns, limit)
    assert {info.clip for info in found} == kept
    assert len(found) == 2 * len(kept)


def test_a_look_is_no_result_and_a_whole_run_goes_on_from_it(tmp_path):
    (look,) = run(tmp_path / "some", limit=2)
    assert look.look
    assert store.find_results(tmp_path / "some") == []
    assert len(list((look.folder / look.method).glob("*.npz"))) == 4  # two clips, two pairs
    kept = {path: path.stat().st_mtime_ns for path in (look.folder / look.method).glob("*.npz")}
    (whole,) = run(tmp_path / "some")
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert (whole.look, whole.begun.exists()) == (False, False)
    assert store.read_header(whole.header).only == ""
    run(tmp_path / "all")
    assert files(tmp_path / "some") == files(tmp_path / "all")


def test_what_a_look_shows_is_over_its_clips_and_says_so(tmp_path):
    places = run(tmp_path, "toy_method", "copy_rotations", clips=("clip 1", "clip 3"))
    (found,) = split_summaries(places, select=Selection(looks=True))
    assert (found.look, found.clips) == ("2 of 5 clips", 2)
    assert {(score.ok, score.asked) for score in found.scores} == {(4, 4)}
    assert found.unfinished == (
        "numbers are over the 4 of 10 cases that all methods here have done so far (--clips clip 1,clip 3)."
    )
    whole = run(tmp_path / "whole", "toy_method", "copy_rotations")
    (over_all,) = split_summaries(whole)
    one, other = (each.scores[0].means[VALUE] for each in (found, over_all))
    assert (one.n, other.n) == (4, 10)


def test_looks_are_left_out_beside_whole_results_unless_they_are_named(tmp_path):
    whole, look = *run(tmp_path, "copy_rotations"), *run(tmp_path, limit=1)
    (found,) = split_summaries([whole, look], select=Selection())
    assert ([score.label for score in found.scores], found.scores[0].ok) == (["copy_rotations"], 10)
    assert (found.looks, found.state) == (("toy_method",), "")
    named = Selection(("copy_rotations", "toy_method"))
    (found,) = split_summaries([whole, look], select=named)
    assert {score.label: score.ok for score in found.scores} == {"copy_rotations": 2, "toy_method": 2}
    assert found.state == " (a quick look: 1 of 5 clips)"


def test_a_look_replaces_no_older_results(tmp_path):
    """They stay as they are, and the look shows its own."""
    (whole,) = run(tmp_path)
    before = {**files(tmp_path), "header": whole.header.read_bytes()}
    (look,) = run(tmp_path, metrics=("position", "contact"), limit=1)
    assert {**{name: files(tmp_path)[name] for name in before if name != "header"}} == {
        name: text for name, text in before.items() if name != "header"
    }
    assert whole.header.read_bytes() == before["header"]
    assert len(store.read_header(look.any_header).metrics) == 2
    (found,) = split_summaries([look], select=Selection(looks=True))
    assert found.look == "1 of 5 clips"
    (found,) = split_summaries([replace(look, look=False)])
    assert (found.look, found.scores[0].ok) == ("", 10)


def test_a_look_that_has_all_clips_is_a_whole_run(tmp_path):
    (place,) = run(tmp_path, limit=5)
    header = store.read_header(place.header)
    assert (place.look, header.only, header.counts.ok) == (False, "", 10)


def test_a_look_takes_no_times(tmp_path):
    (look,) = run(tmp_path, limit=1, timed=True)
    assert not look.timing.exists()
    assert timing.read(look) == []


def test_batches_of_a_look_are_those_of_the_whole_run(tmp_path):
    for file in sorted((HERE / "batch_toys").glob("*.py")):
        registry.add_file(file)
    name = next(e.name for e in registry.names("methods") if "batch" in e.name)
    run(tmp_path / "some", name, limit=1)
    run(tmp_path / "some", name)
    run(tmp_path / "all", name)
    assert files(tmp_path / "some") == files(tmp_path / "all")


def test_a_pattern_that_fits_no_clip_is_an_error(tmp_path):
    with pytest.raises(BenchError, match=r"no clip fits 'walk\*'; there are clip 0, clip 1, .*"):
        run(tmp_path, clips=("clip 1", "walk*"))


def test_no_clip_at_all_is_refused_by_the_command(tmp_path, capsys):
    """Not taken for all of them."""
    with pytest.raises(SystemExit) as stop:
        main(["run", "ik", "--clips", ",", "--out", str(tmp_path)])
    assert stop.value.code == 2
    assert "',' names no clip; leave it out for all of them" in capsys.readouterr().err


def test_the_commands(tmp_path, capsys):
    toys = [word for name in ("cases", "method") for word in ("--plugin", HERE / "toys" / f"toy_{name}.py")]
    common = ("-d", "toy_cases", "-s", "cross", "--out", tmp_path, "-j", "1", *toys)
    said = table(capsys, "predict", "toy_method", "--clips", "clip 0", *common)
    assert said.startswith("2 predictions in")
    assert "These are of some clips (--clips clip 0)" in said
    for command in ("score", "run"):
        said = table(capsys, command, "toy_method", "-m", "position", "--limit", "1", *common)
        assert "(a quick look: 1 of 3 clips)" in said.splitlines()[0]
        assert "numbers are over the 2 of 6 cases" in " ".join(said.split())
    assert "(a quick look: 1 of 3 clips)" in table(capsys, "table", tmp_path)
    said = table(capsys, "run", "toy_method", "-m", "position", *common)
    assert "quick look" not in said
