"""``import retarget_bench as rb``: runs, results and motions, against files and against sums by hand."""

from __future__ import annotations

import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import retarget_bench as rb
from retarget_bench.cli import main
from retarget_bench.motion import bvh, importer
from retarget_bench.motion.files.reading import Reading
from retarget_bench.plugins import registry
from retarget_bench.python.views import ListFrame
from tests.bench_command import method_file
from tests.engine import stored
from tests.in_process import without_processes
from tests.viewing.small_runs import bvh_file

ROOT = Path(__file__).parents[1]
TOYS = ROOT / "tests" / "engine" / "toys"
FILES = [TOYS / "toy_cases.py", TOYS / "toy_method.py"]
MOVED = "return target.motion(source.rotations, source.root + {step}, source.fps)"


@pytest.fixture(autouse=True)
def _alone(tmp_path, monkeypatch):
    """In a folder of its own, with no plug-in files from before, and without processes."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_FILES", {})
    with without_processes():
        yield


def run(*methods, **options) -> rb.Results:
    usual = {
        "dataset": "toy_cases",
        "metrics": "position",
        "timed": False,
        "progress": False,
    }
    for file in FILES:
        registry.add_file(file)
    return rb.run(list(methods), **(usual | options))


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> rb.Results:
    """Three methods on a toy data set: one a step away, one that moves at random, one that refuses."""
    with without_processes():
        names = ("toy_method", "toy_method[does=shaken]", "toy_method[does=picky]")
        return run(*names, out=tmp_path_factory.mktemp("results"))


def per_clip(rows: pd.DataFrame) -> pd.Series:
    """Means over cases of each clip, by hand."""
    return rows.groupby("clip").value.mean()


# ---------------------------------------------------------------------------------------------- results
def test_rows_are_those_of_the_files(results):
    written = [
        pd.read_csv(place.rows, keep_default_na=False).assign(split=place.split, name=place.method)
        for place in results.places
    ]
    expected = pd.concat(written)
    rows = results.rows
    assert len(rows) == len(expected)
    keys = ["split", "case", "value_id", "index"]
    np.testing.assert_array_equal(
        rows.sort_values([*keys, "value"]).value, expected.sort_values([*keys, "value"]).value
    )
    assert set(rows.method) == set(results.methods) == {
        "toy_method", "toy_method[does=shaken]", "toy_method[does=picky]",
    }  # fmt: skip
    assert (rows.case == "toy/" + rows.source + ">" + rows.target + "/" + rows["clip"]).all()
    assert rows[["split", "kind", "frames", "seed"]].drop_duplicates().values.tolist() == [
        ["intra", "wiggle", 12, 0],
        ["cross", "wiggle", 12, 0],
    ]


def test_tables_hold_means_over_clips_of_the_rows(results):
    frame = results.table("mpjpe_h.world").frame
    rows = results.rows[results.rows.value_id == "mpjpe_h.world"]
    for line in frame.itertuples():
        selected = rows[(rows.method == line.method) & (rows.split == line.split)]
        assert line.value == pytest.approx(per_clip(selected).mean(), rel=1e-6)
        assert (line.cases, line.clips) == (len(selected), selected["clip"].nunique())
        assert line.ranked == (line.method != "toy_method[does=picky]")
    assert str(results.table()) == str(rb.load_results(results.places[0].root).table())


def test_lists_show_texts_beside_missing_ones():
    shown = str(ListFrame({"a": ["long text", float("nan")], "b": ["x", "y"]})).splitlines()
    assert [line.split() for line in shown] == [["a", "b"], ["0", "long", "text", "x"], ["1", "NaN", "y"]]


def test_the_best_are_named_only_where_clips_can_tell(results):
    """Errors of 0.01 m and of shaken limbs: the order is known; three clips cannot test it, twelve can."""
    best = results.table("mpjpe_h.world").best()
    assert best.loc["mpjpe_h.world", "intra"] == "toy_method (not tested)"
    more = run("toy_method", "toy_method[does=shaken]", dataset="toy_cases[clips=12]", splits="intra")
    assert more.table("mpjpe_h.world").best().loc["mpjpe_h.world", "intra"] == "toy_method"
    comparison = more.compare("toy_method", "toy_method[does=shaken]", "mpjpe_h.world")
    (line,) = comparison.frame.itertuples()
    rows = more.rows[more.rows.value_id == "mpjpe_h.world"]
    one, two = (per_clip(rows[rows.method == name]) for name in more.methods)
    assert line.difference == pytest.approx((one - two).mean(), rel=1e-6)
    assert line.low < line.difference < line.high < 0
    assert line.clips == 12
    assert line.verdict.startswith("toy_method better")
    assert "toy_method better" in str(comparison)


def test_the_worst_cases_come_first_whatever_better_means(results):
    rows = results.rows[
        (results.rows.method == "toy_method[does=shaken]") & (results.rows.split == "cross")
    ]
    worst = results.worst("toy_method[does=shaken]", "mpjpe_h.world", splits="cross", n=4)
    expected = rows[rows.value_id == "mpjpe_h.world"].nlargest(4, "value")
    assert worst.case.tolist() == expected.case.tolist()
    assert worst["mpjpe_h.world"].tolist() == expected.value.tolist()
    with pytest.raises(rb.BenchError, match="no result has a value 'nothing'"):
        results.worst("toy_method", "nothing")


def test_worst_cases_of_what_no_case_has_are_answered_by_the_reason(tmp_path):
    place = stored.store(tmp_path, "cross", "m", [("a>b", "c1", {"mpjpe_h.world": 1.0})])
    needs = stored.VALUES | {"ratio": stored.VALUES["ratio"] | {"needs": ["rotations"]}}
    stored.changed(place, set_values={"fid": stored.VALUES["ratio"] | {"label": "FID"}}, values=needs)
    loaded = rb.load_results(tmp_path)
    with pytest.raises(rb.BenchError, match=r"FID \(fid\) is a value of all answers as one set") as error:
        loaded.worst("m", "FID")
    assert len(str(error.value)) < 250
    with pytest.raises(rb.BenchError, match=r"no answer of m has a ratio \(ratio\): needs rotations"):
        loaded.worst("m", "ratio")


def test_rows_and_worst_cases_tell_people_from_four_legged_bodies(tmp_path):
    cases = [("ann>bo", "c1", {"mpjpe_h.world": 1.0}), ("rex>rex", "c2", {"mpjpe_h.world": 9.0})]
    place = stored.store(tmp_path, "cross", "m", [*cases, ("ann>rex", "c3", {"mpjpe_h.world": 5.0})])
    rows = rb.load_results(tmp_path).rows
    assert set(rows.bodies) == {""}  # they do not say
    stored.metadata(place, legs={"ann": "2", "bo": "2", "rex": "4"})
    results = rb.load_results(tmp_path)
    means = results.rows.groupby("bodies").value.mean()
    assert means.to_dict() == {"people": 1.0, "four-legged": 9.0, "mixed": 5.0}
    assert results.worst("m").bodies.tolist() == ["people"]
    assert results.worst("m", bodies="four-legged")["mpjpe_h.world"].tolist() == [9.0]
    assert results.worst("m", bodies="all").bodies.tolist() == ["four-legged", "mixed", "people"]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: rb.load_motion(3), "load_motion: path is 3, of type int; it takes text or a path"),
        (lambda r: rb.load_character(b"a"), "load_character: path is b'a', of type bytes; it takes text"),
        (
            lambda r: rb.load_motion("a.bvh", fps="30"),
            "fps is '30', of type str; it takes a number or None",
        ),
        (lambda r: rb.retarget(None, "a.bvh"), "retarget: source is None"),
        (lambda r: rb.run([1]), r"methods is \[1\], of type list; it takes text or .* a list of such"),
        (
            lambda r: rb.run("ik", overwrite="yes"),
            "overwrite: 'yes' is not known; it is one of never, missing, failed",
        ),
        (lambda r: rb.run("ik", seeds=0), "seeds is 0; it must be at least 1"),
        (lambda r: rb.run("ik", clips=3), "clips is 3, of type int; it takes text"),
        (lambda r: rb.run("ik", clips=["walk", " , "]), "' , ' names no clip; leave it out for all"),
        (lambda r: r.compare(1, 2), "first is 1, of type int; it takes text"),
        (lambda r: r.table(by="colour"), "by: 'colour' is not known"),
        (lambda r: r.table().save(1), "save: path is 1"),
        (lambda r: r.worst("toy_method", n="3"), "worst: n is '3', of type str; it takes a whole number"),
    ],
)
def test_arguments_of_the_wrong_type_are_told_in_a_sentence(results, call, message):
    with pytest.raises(rb.BenchError, match=message):
        call(results)


def test_arguments_of_alike_types_are_taken_as_they_are(results):
    """numpy's numbers, and columns of data frames."""
    frame = results.worst("toy_method", n=np.int64(2))
    assert len(frame) == 2
    names = pd.Series(["toy_method", "toy_method[does=shaken]"])
    assert results.only(names).methods == list(names)
    with pytest.raises(TypeError, match=r"load_motion\(\) missing"):
        rb.load_motion()  # type: ignore[call-arg]


def test_refused_cases_are_problems_and_cost_no_other(results):
    problems = results.problems
    assert set(problems.method) == {"toy_method[does=picky]"}
    assert set(problems.status) == {"unsupported"}
    assert set(problems.message) == {"I only know tall targets"}
    assert problems.case.str.contains("tall>small").all()
    assert len(problems) == 6
    assert not results.only("toy_method").problems.size


def test_results_can_be_narrowed(results):
    some = results.only(["toy_method"], "cross")
    assert (some.methods, some.splits) == (["toy_method"], ["cross"])
    assert "cross of toy_cases: 6 cases" in repr(some)
    with pytest.raises(rb.BenchError, match="no results of split 'self' here; there are intra, cross"):
        results.only(splits=["self"])
    with pytest.raises(rb.BenchError, match=r"no results of 'toy_metod' here; did you mean toy_method"):
        results.only("toy_metod")


# --------------------------------------------------------------------------------------- saving, loading
def files_in(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_saved_results_are_the_same_and_alone(results, tmp_path):
    saved = results.only("toy_method").save(tmp_path / "kept")
    later = rb.load_results(saved)
    narrowed = results.only("toy_method")
    pd.testing.assert_frame_equal(later.rows, narrowed.rows)
    assert str(later.table()) == str(narrowed.table())
    here, there = files_in(saved), files_in(results.places[0].root)
    assert here.items() <= there.items()
    assert not [name for name in here if "toy_method-" in name]
    assert len([name for name in here if name.endswith(".npz") and "toy_method/" in name]) == 12


def test_saving_replaces_nothing_by_accident_and_leaves_nothing_half_done(results, tmp_path, monkeypatch):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.txt").write_text("work of years")
    for overwrite in (False, True):
        with pytest.raises(rb.BenchError, match="thesis holds other files than results"):
            results.save("thesis", overwrite=overwrite)
    with pytest.raises(rb.BenchError, match="is where these results lie"):
        results.save(results.places[0].root, overwrite=True)
    results.only("toy_method").save("notes")
    (tmp_path / "notes" / "read_me.txt").write_text("by hand")
    with pytest.raises(rb.BenchError, match="notes holds other files than results"):
        results.save("notes", overwrite=True)
    results.only("toy_method").save("kept")
    before = files_in(tmp_path)
    with pytest.raises(rb.BenchError, match="overwrite=True"):
        results.save("kept")

    def full(*args, **kwargs):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(shutil, "copytree", full)
        with pytest.raises(rb.BenchError, match="kept: cannot be written"):
            results.save("kept", overwrite=True)
    assert files_in(tmp_path) == before
    results.save("kept", overwrite=True)
    assert sorted(rb.load_results("kept").methods) == sorted(results.methods)
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_an_empty_list_of_methods_is_not_all_of_them():
    with pytest.raises(rb.BenchError, match="methods is empty"):
        rb.run([], progress=False)


def test_folders_without_results_are_told():
    with pytest.raises(rb.BenchError, match=r"in nowhere; rb.run\(..., task='joint-completion'"):
        rb.load_results("nowhere", task="joint-completion")
    with pytest.raises(rb.BenchError, match=r"no results in nowhere; rb.run.*out='nowhere'.* makes some"):
        rb.load_results("nowhere")


# ------------------------------------------------------------------------------------------------- runs
def test_commands_and_python_share_results(results, capsys):
    shutil.copytree(results.places[0].root, "runs")
    again = run("toy_method", overwrite="never")
    assert again.methods == ["toy_method"]
    with pytest.raises(SystemExit):
        main(["table"])
    assert str(rb.load_results("runs").table()) == capsys.readouterr().out


def test_a_run_of_some_clips_is_that_of_the_command(results, capsys):
    """Its clips, its table; a run without limits does the rest."""
    shutil.copytree(results.places[0].root, "runs")
    limited = run("toy_method", "toy_method[does=shaken]", "copy_rotations", limit=1)
    assert limited.rows[limited.rows.method == "copy_rotations"]["clip"].nunique() == 1
    assert "1 of 3 clips so far" in str(limited.table())
    names = ["toy_method", "toy_method[does=shaken]", "copy_rotations"]
    with pytest.raises(SystemExit):
        main(["run", *names, "-d", "toy_cases", "--metrics", "position", "--limit", "1", "-j", "1"])
    output = capsys.readouterr().out
    assert str(limited.table()) == output[: len(str(limited.table()))]
    assert len(limited.problems) == 0
    with pytest.raises(rb.BenchError, match="the results of copy_rotations are not complete"):
        limited.save("kept")
    assert not Path("kept").exists()
    with pytest.raises(rb.BenchError, match=r"no clip fits 'walk\*'; there are clip 0"):
        run("copy_rotations", clips="walk*")
    complete = run("copy_rotations")
    assert complete.rows["clip"].nunique() == results.rows["clip"].nunique()
    assert "so far" not in str(complete.table())


def test_a_method_file_that_changes_in_a_session_is_run_anew():
    errors = []
    for step in (0.0, 0.5, 0.5):
        method_file(Path(), "mine", MOVED.format(step=step))
        rows = run("mine.py", splits="intra").rows
        errors.append(rows[rows.value_id == "mpjpe_h.world"].value.mean())
    assert errors[1] == errors[2] > 10 * errors[0]


def test_a_method_may_be_named_by_its_module_or_class_but_not_be_an_object(monkeypatch):
    method_file(Path(), "mine", MOVED.format(step=0.0))
    monkeypatch.syspath_prepend(".")
    import mine  # type: ignore[import-not-found]

    try:
        assert run(mine, splits="intra").methods == ["mine"]
        assert run(mine.Mine, splits="intra", overwrite="never").methods == ["mine"]
    finally:
        del sys.modules["mine"]

    class Local:
        pass

    for other in (Local, lambda source: source):
        with pytest.raises(
            rb.BenchError, match="cannot be run: worker processes find a method by its name"
        ):
            run(other)
    with pytest.raises(rb.BenchError, match=r"toy_cases is a data set"):
        run(str(FILES[0]))


@pytest.mark.slow
def test_a_plain_script_runs_with_worker_processes(tmp_path):
    """Worker processes do not run the script again, which is guarded by nothing."""
    script = tmp_path / "script.py"
    script.write_text(
        "import retarget_bench as rb\n"
        "print('begins')\n"
        f"found = rb.run([{str(FILES[1])!r}], dataset={str(FILES[0])!r},\n"
        "               metrics='position', splits='intra', jobs=2, timed=False)\n"
        "print(len(found.rows.case.unique()), 'cases')\n"
    )
    completed = subprocess.run(
        [sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert completed.returncode == 0, completed.stderr
    assert completed.stdout == "begins\n6 cases\n"
    assert "6 of 6 answers" in completed.stderr


# ---------------------------------------------------------------------------------------------- motions
def test_a_saved_motion_is_the_file_that_the_command_writes(tmp_path):
    bvh_file(tmp_path / "walk.bvh", 12)
    bvh_file(tmp_path / "me.bvh", 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        walk, me = rb.load_motion("walk.bvh", unit="m"), rb.load_character("me.bvh", unit="m")
        answer = rb.retarget(walk, me, "copy_rotations")
    assert answer.save("python.bvh") == Path("python.bvh")
    with pytest.raises(SystemExit):
        main(
            [
                "retarget",
                "walk.bvh[unit=m]",
                "--target",
                "me.bvh[unit=m]",
                "-o",
                "command.bvh",
                "-m",
                "copy_rotations",
            ]
        )
    assert Path("python.bvh").read_bytes() == Path("command.bvh").read_bytes()
    half = answer.resample(15)
    assert isinstance(half, rb.Motion)
    half.save("half.bvh")
    np.testing.assert_allclose(
        importer.load("half.bvh", Reading(unit="m")).motion.positions, answer.positions[::2], atol=1e-6
    )
    for name, message in (("me.bvh", "would overwrite me.bvh"), ("me.fbx", "ends in .bvh")):
        with pytest.raises(rb.BenchError, match=message):
            answer.save(name)


def test_a_motion_of_no_file_is_saved_in_metres(tmp_path, results):
    motion = importer.load(bvh_file(tmp_path / "walk.bvh", 5), Reading(unit="m")).motion
    body = motion.character
    answer = rb.retarget(motion, body, "copy_rotations")
    answer.save("out.bvh")
    recording = bvh.read("out.bvh")
    np.testing.assert_allclose(recording.root, motion.root, atol=1e-6)
    assert repr(answer) == "<Motion of walk: 5 frames at 30 per second, 0.2 s>"
    with pytest.raises(rb.BenchError, match="resample: fps is '30', of type str; it takes a number"):
        answer.resample("30")


def test_a_doubtful_file_is_warned_of_in_words_of_python(tmp_path):
    file = bvh_file(tmp_path / "giant.bvh", 5)
    recording = importer.load(file, Reading(unit="m")).motion
    bvh.write("giant.bvh", recording, scale=6.0)
    with pytest.warns(UserWarning, match=r"the unit is a guess: .* say unit=\w+ or unit=\w+") as caught:
        rb.load_motion("giant.bvh")
    assert "--" not in str(caught[0].message)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert rb.load_motion("giant.bvh", unit=str(1 / 6)).character.height == pytest.approx(
            recording.character.height
        )


# ------------------------------------------------------------------------------------------------ lists
def test_lists_hold_what_there_is_and_rooms_stay_packages():
    import retarget_bench.methods.copy_rotations as module

    assert module.plugin().card.name == "copy_rotations"
    assert set(rb.methods().name) == {entry.name for entry in registry.names("methods")}
    assert set(rb.datasets().name) >= {"puppets", "folder"}
    values = rb.metrics().set_index("value_id")
    assert tuple(values.loc["mpjpe_h.world", ["metric", "unit", "better"]]) == (
        "position", "% of height", "lower",
    )  # fmt: skip
    summary = rb.methods().summary.max()
    assert summary in repr(rb.methods())
    assert all(getattr(rb, name) is not None and name in dir(rb) for name in rb.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        rb.nothing  # noqa: B018


def test_a_case_can_be_shown_and_its_motions_taken(results, tmp_path):
    for file in FILES:
        registry.add_file(file)
    case = results.rows.case.iloc[0]
    player = results.show(case, "toy_method")
    assert "toy_method" in repr(player)
    assert "<iframe" in player._repr_html_()
    assert player.save(tmp_path / "player.html").read_text(encoding="utf-8") == player.html
    with pytest.raises(rb.BenchError, match=r"end its name in \.html"):
        player.save(tmp_path / "player.mp4")
    source, answer = results.motion(case, "source"), results.motion(case, "toy_method")
    assert answer.frames == source.frames
    with pytest.raises(rb.BenchError, match="has no 'nobody'"):
        results.motion(case, "nobody")


def test_tables_are_written_by_the_ending_of_their_name(results, tmp_path):
    table = results.table()
    assert "<table" in table._repr_html_()
    assert table.save(tmp_path / "table.md").read_text(encoding="utf-8").count("|") > 10
    with pytest.raises(rb.BenchError, match="end the name in one"):
        table.save(tmp_path / "table.doc")
