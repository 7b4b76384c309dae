"""The two stages end to end, on toy plug-ins: statuses, files, keys, resuming."""

import csv
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_plans import TOYS, asked, carry_out

from retarget_bench import files
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import runner
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import case_metadata, journal, predictions, store

pytestmark = pytest.mark.usefixtures("in_process", "toys")

SHIFT = 0.01  # as in toys/toy_cases.py


def test_rows_hold_the_known_error_of_every_case(tmp_path):
    (results,) = carry_out(tmp_path, "toy_method")
    height = {"tall": 1.5, "small": 1.0}
    assert len(results.entries) == 6
    for entry in results.entries:
        target = results.cases[entry.case].target
        body_height = height[target] * (0.3 + 0.4 + np.hypot(0.1, 0.05) + 0.8)
        assert entry.values["mpjpe_h.world"] == pytest.approx(100 * SHIFT / body_height, rel=1e-5)
        assert entry.values["mpjpe_h.root"] == pytest.approx(0, abs=1e-4)


def test_rows_are_sorted_text_with_nine_digits(tmp_path):
    (results,) = carry_out(tmp_path, "toy_method")
    raw = results.paths.rows.read_bytes()
    assert b"\r" not in raw
    rows = list(csv.reader(raw.decode().splitlines()))
    assert rows[0] == ["case", "value_id", "index", "value"]
    assert rows[1:] == sorted(rows[1:], key=lambda row: row[:3])
    assert all(row[3] == f"{float(row[3]):.9g}" for row in rows[1:])


@pytest.mark.parametrize(
    ("does", "status", "words"),
    [
        ("nan", "invalid", "not finite"),
        ("short", "invalid", "returned 11 frames; the source has 12"),
        ("double", "invalid", "not unit"),
        ("wrong_body", "invalid", "the target is"),
        ("nothing", "invalid", "NoneType"),
        ("raise", "failed", "RuntimeError: out of ideas (toy_method.py:"),
        ("far", "invalid", "lengths are in metres"),
        ("interrupt", "failed", "KeyboardInterrupt"),
        ("leak", "failed", "AttributeError"),
        pytest.param("die", "failed", "signal SIGKILL", marks=pytest.mark.processes),
    ],
)
def test_a_bad_method_costs_its_rows_and_says_why(tmp_path, does, status, words):
    clips = 1 if does == "die" else 3  # each case that dies costs a new process
    bad, good = carry_out(tmp_path, f"toy_method[does={does}]", "toy_method", clips=clips)
    assert {entry.status for entry in good.entries} == {"ok"}
    assert {entry.status for entry in bad.entries} == {status}
    assert all(words in entry.message for entry in bad.entries)
    assert getattr(bad.header.counts, status) == bad.header.counts.asked == 2 * clips
    assert all(not entry.values for entry in bad.entries)


@pytest.mark.processes
def test_a_case_that_kills_its_worker_costs_that_case_only(tmp_path):
    angle = round(np.sin(0.15 * np.sin(2 * np.pi * 3 / 30 / 2)), 3)  # clip 0, frame 3
    (results,) = carry_out(tmp_path, f"toy_method[does=die,on={angle}]", jobs=2)
    assert [entry.status for entry in results.entries].count("failed") == 2
    assert {results.cases[e.case].clip for e in results.entries if e.status == "failed"} == {"clip 0"}


def test_only_declared_privileged_inputs_reach_a_method(tmp_path):
    peek, other = carry_out(tmp_path, "toy_method[does=peek]", "toy_method[does=other]")
    assert all(entry.values["mpjpe_h.world"] < 1e-4 for entry in peek.entries)
    assert peek.header.method.privileged == ("reference",)
    assert {entry.status for entry in other.entries} == {"ok"}


def test_positions_are_an_answer_too(tmp_path):
    by_rotations, by_positions = carry_out(tmp_path, "toy_method", "toy_method[does=positions]")
    for one, two in zip(by_rotations.entries, by_positions.entries, strict=True):
        assert one.values["mpjpe_h.world"] == pytest.approx(two.values["mpjpe_h.world"], rel=1e-4)


def test_seeds_belong_to_cases(tmp_path):
    (few,) = carry_out(tmp_path / "few", "toy_method[does=noise]")
    more = replace(
        asked(tmp_path / "more", "toy_method[does=noise]"), datasets=(Spec.parse("toy_cases[clips=5]"),)
    )
    (many,) = [store.read_results(place) for place in runner.run(more, lambda done, total: None)]
    values = {entry.case: entry.values for entry in many.entries}
    assert all(values[entry.case] == entry.values for entry in few.entries)
    (other,) = carry_out(tmp_path / "other", "toy_method[does=noise]", seed=1)
    assert all(a.values != b.values for a, b in zip(few.entries, other.entries, strict=True))


# ------------------------------------------------------------------------------------------- resuming


def test_a_changed_metric_list_rescores_without_predicting(tmp_path):
    (first,) = carry_out(tmp_path, "toy_method")
    files = sorted((first.paths.folder / first.paths.method).glob("*.npz"))
    before = [file.stat().st_mtime_ns for file in files]
    place = runner.run(
        replace(asked(tmp_path, "toy_method"), metrics=("position", "ground")), lambda d, t: None
    )[0]
    assert [file.stat().st_mtime_ns for file in files] == before
    assert set(store.read_results(place).header.metrics) == {"position", "ground"}


def test_predict_then_score_is_run(tmp_path):
    (both,) = carry_out(tmp_path / "a", "toy_method[does=picky]")
    places = runner.run(asked(tmp_path / "b", "toy_method[does=picky]", stage="predict"), lambda d, t: None)
    assert not places[0].rows.exists()
    (apart,) = carry_out(tmp_path / "b", "toy_method[does=picky]", stage="score")
    assert apart.paths.rows.read_bytes() == both.paths.rows.read_bytes()
    assert apart.header.problems == both.header.problems


def test_scoring_without_predictions_says_what_is_missing_and_spoils_nothing(tmp_path):
    (results,) = carry_out(tmp_path, "toy_method", stage="score")
    assert results.header.counts.missing == 6
    (later,) = carry_out(tmp_path, "toy_method")
    assert later.header.counts.ok == 6


def test_what_cannot_be_stored_stops_the_run_and_blames_no_method(tmp_path):
    (tmp_path / "toy_cases/retarget/intra").mkdir(parents=True)
    blocked = tmp_path / "toy_cases/retarget/intra/toy_method"
    blocked.write_text("a file where the predictions should go")
    with pytest.raises(BenchError, match=r"stopped: .*cannot be written.*run again to continue"):
        carry_out(tmp_path, "toy_method")
    blocked.unlink()
    (results,) = carry_out(tmp_path, "toy_method")
    assert results.header.counts.ok == 6


def test_no_case_at_all_is_an_error_with_the_data_sets_notes(tmp_path):
    empty = replace(asked(tmp_path, "toy_method"), datasets=(Spec.parse("toy_cases[clips=0]"),))
    with pytest.raises(BenchError, match=r"there is no case in intra\. toy_cases: "):
        runner.run(empty, lambda done, total: None)


@pytest.mark.parametrize("line", ['{"foo": 1}\n', "5\n", '"text"\n', "[1, 2]\n", '{"case": "toy/tall>sm'])
def test_a_journal_that_was_torn_or_edited_is_read_up_to_there(tmp_path, line):
    (first,) = carry_out(tmp_path, "toy_method")
    place, expected = first.paths, first.paths.rows.read_bytes()
    place.header.unlink()
    journal.open_journal(place, first.header.keys)
    journal.append_journal(place, first.entries[0])
    content = place.journal.read_bytes()
    with place.journal.open("a") as file:
        file.write(line)
    assert list(journal.open_journal(place, first.header.keys)) == [first.entries[0].case]
    assert place.journal.read_bytes() == content
    (again,) = carry_out(tmp_path, "toy_method")
    assert again.paths.rows.read_bytes() == expected
    assert not place.journal.exists()


def test_redo(tmp_path):
    (first,) = carry_out(tmp_path, "toy_method[does=raise]")
    jobs = {}
    for redo in ("never", "missing", "failed", "always"):
        counts = []
        runner.run(
            asked(tmp_path, "toy_method[does=raise]", overwrite=redo),
            lambda done, total, to=counts: to.append(total),
        )
        jobs[redo] = counts[0]
    assert jobs == {"never": 0, "missing": 0, "failed": 6, "always": 6}
    assert first.paths.rows.exists()


def test_a_damaged_prediction_is_made_again(tmp_path):
    (first,) = carry_out(tmp_path, "toy_method")
    expected = first.paths.rows.read_bytes()
    victim = next((first.paths.folder / "toy_method").glob("*.npz"))
    victim.write_bytes(victim.read_bytes()[:100])
    first.paths.header.unlink()
    (again,) = carry_out(tmp_path, "toy_method")
    assert again.paths.rows.read_bytes() == expected
    assert predictions.stored_key(victim)


def test_what_a_killed_process_was_writing_is_removed(tmp_path):
    (first,) = carry_out(tmp_path, "toy_method")
    place = first.paths
    place.header.unlink()
    left = []
    for file in (place.journal, place.rows, place.header):
        with files.atomic(file) as temporary:
            temporary.write_text("half")
            left.append(temporary)
        file.unlink()
    others = [
        place.folder / ".0123456789ab.other_method.journal",
        place.folder / f".notes.{place.rows.name}",
    ]
    for path in (*left, *others):
        path.write_text("half")
    carry_out(tmp_path, "toy_method")
    assert [path.exists() for path in left] == [False] * 3
    assert [path.exists() for path in others] == [True] * 2


@pytest.mark.slow
@pytest.mark.parametrize(("kills", "clips"), [(2, 16), (20, 40)])
def test_killed_at_random_moments_gives_the_same_bytes(tmp_path, kills, clips):
    """SIGKILL to the whole run, again and again, then one run to the end."""
    method, data = TOYS / "toy_method.py", TOYS / "toy_cases.py"
    methods = (f"{method}", f"{method}[does=shaken]", str(TOYS.parent / "batch_toys" / "toy_batches.py"))
    line = [sys.executable, "-m", "retarget_bench", "run", *methods]
    line += ["-d", f"{data}[clips={clips}]", "-s", "intra", "--metrics", "position", "-j", "2"]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    start = time.monotonic()
    subprocess.run([*line, "--out", tmp_path / "whole"], env=environment, check=True, capture_output=True)
    duration = time.monotonic() - start
    moments = random.Random(5)
    killed = 0
    for _ in range(4 * kills):  # on a machine that does much else, some end first
        start = time.monotonic()
        process = subprocess.Popen(
            [*line, "--out", tmp_path / "killed"],
            env=environment,
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            process.wait(moments.uniform(0.2, 0.8) * duration)
            duration = min(duration, time.monotonic() - start)
            for file in (tmp_path / "killed").rglob("*.json"):
                file.unlink()
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            killed += 1
        if killed == kills:
            break
    assert killed
    subprocess.run([*line, "--out", tmp_path / "killed"], env=environment, check=True, capture_output=True)
    for expected in sorted((tmp_path / "whole").rglob("intra/*")):
        if expected.suffix in (".csv", ".npz") and not expected.name.endswith(".timing.csv"):
            actual = tmp_path / "killed" / expected.relative_to(tmp_path / "whole")
            assert actual.read_bytes() == expected.read_bytes(), expected.name
    assert not list((tmp_path / "killed").rglob("*.journal"))


# --------------------------------------------------------------------------------------- keys and slugs
def test_a_key_is_pinned():
    facts = {"method": "copy_rotations", "parameters": {"root_rule": "height"}, "seed": 0}
    assert (
        files.facts_digest(facts) == files.facts_digest(dict(reversed(facts.items()))) == "88d4b6a8b920a97f"
    )


def test_a_run_leaves_what_tables_need_to_show_it_before_it_is_done(tmp_path):
    counts = []

    def watch(answered, total):
        for place in store.find_results(tmp_path):
            assert not place.complete
            header = store.read_header(place.begun)
            cases = store.read_cases(place.cases, place.task, place.split)
            results = store.read_results(place, header)
            answered = [each for each in results.entries if each.status == "ok"]
            assert case_metadata.read(place).legs == {"tall": "2", "small": "2"}
            counts.append(
                (len(answered), results.header.counts.ok, results.header.counts.missing, len(cases))
            )

    (place,) = runner.run(asked(tmp_path, "toy_method", jobs=1), watch)
    assert counts[0][1:] == (0, counts[0][3], counts[0][3])
    assert any(0 < ok < count for _, ok, _, count in counts)
    assert all(entries == ok and ok + missing == count for entries, ok, missing, count in counts)
    assert store.find_results(tmp_path) == [place]
    assert place.complete


def test_results_where_no_folder_can_be(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BenchError, match="file"):
        carry_out(tmp_path / "file", "toy_method")
