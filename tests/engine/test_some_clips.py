"""Runs of some clips: results that are not complete, and that a whole run goes on from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from small_plans import TOYS, asked

from retarget_bench.analysis.selection import Selection
from retarget_bench.analysis.summary import split_summaries
from retarget_bench.api import CaseInfo
from retarget_bench.cli import main
from retarget_bench.evaluation import runner, timing
from retarget_bench.evaluation.clips import chosen
from retarget_bench.results import store

pytestmark = pytest.mark.usefixtures("in_process", "toys")


def run(root: Path, *methods: str, timed: bool = False, **changes) -> list[store.ResultPaths]:
    limits = {name: changes.pop(name) for name in ("clips", "limit") if name in changes}
    plan = replace(asked(root, *(methods or ("toy_method",)), clips=5, **changes), **limits)
    return runner.run(plan, lambda done, total: None, timed=timed)


def files(root: Path) -> dict[str, bytes]:
    """What a run leaves, but headers, which hold dates and times."""
    paths = (path for path in root.rglob("*") if path.is_file() and path.suffix in (".csv", ".npz"))
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in paths}


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
    ("patterns", "limit", "expected"),
    [
        ((), 2, {"walk", "Run [fast]"}),
        ((), 9, {"walk", "walk back", "Run [fast]", "jump"}),
        (("WALK*",), 0, {"walk", "walk back"}),
        (("walk*",), 1, {"walk"}),
        (("run [fast]", "jum?"), 0, {"Run [fast]", "jump"}),
        (("nothing",), 0, set()),
    ],
)
def test_clips_are_chosen_with_all_their_pairs(patterns, limit, expected):
    selected = chosen(infos("walk", "walk back", "Run [fast]", "jump"), patterns, limit)
    assert {info.clip for info in selected} == expected
    assert len(selected) == 2 * len(expected)


def test_a_whole_run_goes_on_from_one_of_some_clips(tmp_path):
    (some,) = run(tmp_path / "some", limit=2)
    assert not some.complete
    assert store.find_results(tmp_path / "some") == [some]
    assert len(list((some.folder / some.method).glob("*.npz"))) == 4  # two clips, two pairs
    times = {path: path.stat().st_mtime_ns for path in (some.folder / some.method).glob("*.npz")}
    (complete,) = run(tmp_path / "some")
    assert {path: path.stat().st_mtime_ns for path in times} == times
    assert (complete.complete, complete.journal.exists()) == (True, False)
    run(tmp_path / "all")
    assert files(tmp_path / "some") == files(tmp_path / "all")


def test_a_published_table_is_over_the_clips_that_are_there_and_says_so(tmp_path, capsys):
    run(tmp_path, "copy_rotations", splits=("cross",), limit=2)
    assert "- cross: 2 of 5 clips so far" in table(
        capsys, "table", "-r", tmp_path, "--paper", "humot-table5"
    )


def test_what_a_run_has_begun_replaces_older_results_until_those_count_again(tmp_path):
    """Where nothing of theirs is outdated they do not have to be computed again."""
    (place,) = run(tmp_path)
    before = {**files(tmp_path), "header": place.header.read_bytes()}
    run(tmp_path, metrics=("position", "contact_speed"), limit=1)
    (split_summary,) = split_summaries([place], select=Selection())
    assert split_summary.so_far == "1 of 5 clips so far"
    assert len(store.read_header(place.any_header).metrics) == 2
    (split_summary,) = split_summaries(run(tmp_path), select=Selection())
    assert (split_summary.so_far, split_summary.scores[0].ok) == ("", 10)
    assert {**files(tmp_path), "header": place.header.read_bytes()} == before


def test_the_case_list_is_of_the_data_that_a_run_has_begun_with(tmp_path):
    run(tmp_path)
    (place,) = run(tmp_path)
    store.write_cases(place, infos("walk"))  # as of other data
    run(tmp_path, overwrite="always", limit=1)
    (split_summary,) = split_summaries([place], select=Selection())
    assert (split_summary.so_far, split_summary.scores[0].ok) == ("1 of 5 clips so far", 2)


def test_a_run_of_clips_that_are_all_is_a_whole_run(tmp_path):
    (place,) = run(tmp_path, limit=5)
    assert (place.complete, store.read_header(place.header).counts.ok) == (True, 10)


def test_results_that_are_not_complete_have_no_times(tmp_path):
    (place,) = run(tmp_path, limit=1, timed=True)
    assert not place.timing.exists()
    assert timing.read(place) == []


def test_batches_are_those_of_the_whole_run(tmp_path):
    run(tmp_path / "some", "toy_batches", limit=1)
    run(tmp_path / "some", "toy_batches")
    run(tmp_path / "all", "toy_batches")
    assert files(tmp_path / "some") == files(tmp_path / "all")


def test_stages_of_some_clips_say_so(tmp_path, capsys):
    common = ("-d", TOYS / "toy_cases.py", "-s", "cross", "--out", tmp_path, "-j", "1")
    output = table(
        capsys, "run", "--stage", "predict", TOYS / "toy_method.py", "--clips", "clip 0", *common
    )
    assert output.startswith("2 predictions in")
    assert "These are of some clips" in output
    output = table(
        capsys, "run", "--stage", "score", "toy_method", "--metrics", "position", "--limit", "1", *common
    )
    assert "cross: 1 of 3 clips so far." in output
    assert "A run without --clips and --limit does the rest" in output
