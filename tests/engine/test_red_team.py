"""Methods that cheat, hang, crash and litter: each costs its own rows, and nothing else changes."""

import os
import subprocess
import sys
import time
from pathlib import Path
from shutil import which

import psutil
import pytest
from small_plans import asked

from retarget_bench import files
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import runner
from retarget_bench.evaluation.executors import local
from retarget_bench.evaluation.prediction import launch
from retarget_bench.evaluation.prediction.limits import LONGEST_LOG
from retarget_bench.plugins import registry
from retarget_bench.results import store
from tests.in_process import run_here

HERE = Path(__file__).parent
HONEST = ("copy_rotations", "toy_method")
ATTACKS = {
    "frame": ("failed", "no answer in any frame"),
    "gc": ("failed", "no answer in memory"),
    "setflags": ("ok", ""),
    "patch": ("ok", ""),
    "hang": ("failed", "no answer within 4 s"),
    "fork": ("ok", ""),
    "hold": ("failed", "without an answer"),
    "leak": ("failed", "more than 0.25 GB"),
    "print": ("ok", ""),
    "folders": ("ok", ""),
    "crash": ("failed", "signal SIGSEGV"),
    "kill_server": ("failed", "process ended"),
    "stop_server": ("ok", ""),
    "kill_scorer": ("failed", "ended twice at this (signal SIGKILL)"),
    "stop_scorer": ("failed", "ended twice at this (no sign of life for 6 s)"),
    "kill_others": ("ok", ""),
    "tamper": ("ok", ""),
    "fill": ("failed", "more than 1 GB of files"),
    "endless": ("failed", "lines of many megabytes"),
    "zombies": ("ok", ""),
    "shared": ("ok", ""),
}
MEMORIES = ("remember", "remember_batches")
QUICK = ("frame", "gc", "setflags", "patch", "print", "folders", "crash", "shared")
"""Attacks that cost neither a time limit nor the process that scores."""
LIMITS = {"timeout": 4.0, "memory": 0.25, "clips": 1, "jobs": 2}


@pytest.fixture(scope="module", autouse=True)
def _plugins():
    for file in (HERE / "toys" / "toy_cases.py", HERE / "toys" / "toy_method.py"):
        registry.add_file(file)
    registry.add_file(HERE / "red_team" / "hostile.py")


@pytest.fixture(
    scope="module",
    params=[QUICK, pytest.param(tuple(ATTACKS), marks=pytest.mark.slow)],
    ids=["quick", "all"],
)
def battle(request, tmp_path_factory):
    """The folder of a run with attacks (``with``), of one without, and of what they were run in."""
    folder = tmp_path_factory.mktemp("red-team")
    (folder / "at-home").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(local, "SILENCE", 6.0)
        patch.chdir(folder / "at-home")
        Path("precious.txt").write_text("mine")
        attacks = [f"hostile[does={does}]" for does in (*request.param, *MEMORIES)]
        runner.run(asked(folder / "with", *attacks, *HONEST, **LIMITS), lambda done, total: None)
    run_here(asked(folder / "without", *HONEST, **LIMITS))
    return folder


def _results(root: Path) -> dict[str, store.Results]:
    read = [store.read_results(place) for place in store.find_results(root)]
    return {each.header.method.label: each for each in read}


def test_an_attack_has_its_own_status(battle, request):
    results = _results(battle / "with")
    for does in request.node.callspec.params["battle"]:
        status, words = ATTACKS[does]
        entries = results[f"hostile[does={does}]"].entries
        assert {each.status for each in entries} == {status}, (does, {each.message for each in entries})
        assert [each.message for each in entries if words not in each.message] == []


@pytest.mark.parametrize("method", HONEST)
@pytest.mark.parametrize("suffix", [".csv", ".npz"])
def test_honest_rows_are_the_same_bytes_as_alone(battle, method, suffix):
    with_, without = (_results(battle / name)[method].paths.rows for name in ("with", "without"))
    assert with_.with_suffix(suffix).read_bytes() == without.with_suffix(suffix).read_bytes()


@pytest.mark.parametrize("does", ["setflags", "patch"])
def test_tampering_gains_nothing(battle, does):
    """Their answers are those of ``toy_method``, and so are their errors."""
    results = _results(battle / "with")
    honest = {each.case: each.values for each in results["toy_method"].entries}
    assert {e.case: e.values for e in results[f"hostile[does={does}]"].entries} == honest


@pytest.mark.parametrize("does", MEMORIES)
def test_what_was_shown_before_is_forgotten(battle, does):
    """Every case of the toys is another one's source: whoever remembers them has no error but a shift."""
    entries = _results(battle / "with")[f"hostile[does={does}]"].entries
    assert {each.status for each in entries} == {"ok"}
    assert min(each.values["mpjpe_h.world"] for each in entries) > 10


@pytest.mark.parametrize(
    ("does", "isolate"),
    [
        ("files", "env FREE=1"),
        pytest.param("places", "bwrap", marks=pytest.mark.skipif(not which("bwrap"), reason="needs bwrap")),
    ],
)
def test_what_was_written_before_is_gone(tmp_path, does, isolate):
    """One worker answers all batches. Without bwrap, what all write to stays: docs/plugins.md."""
    plan = asked(tmp_path, f"hostile[does={does}]", clips=1, jobs=1, isolate=isolate)
    runner.run(plan, lambda done, total: None)
    entries = _results(tmp_path)[f"hostile[does={does}]"].entries
    assert len(entries) > 1
    assert [each.message for each in entries if "forgotten" not in each.message] == []


@pytest.mark.usefixtures("battle")
def test_no_shared_memory_stays():
    assert not list(Path("/dev/shm").glob("hostile-*"))


def test_prints_are_in_a_log_of_limited_length(battle):
    log = _results(battle / "with")["hostile[does=print]"].paths.log
    assert LONGEST_LOG <= log.stat().st_size < LONGEST_LOG + 100
    assert log.read_bytes().startswith(b"xxxx")
    assert not _results(battle / "with")["copy_rotations"].paths.log.exists()


def test_a_crash_leaves_its_traceback_in_the_log(battle):
    log = _results(battle / "with")["hostile[does=crash]"].paths.log.read_text()
    assert "Segmentation fault" in log
    assert "hostile.py" in log


def test_files_of_the_user_stay(battle):
    assert [each.name for each in (battle / "at-home").iterdir()] == ["precious.txt"]


@pytest.mark.usefixtures("battle")
def test_no_process_stays():
    deadline = time.monotonic() + 10
    while (left := _orphans()) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not left


def _orphans() -> list[psutil.Process]:
    """Processes that prediction workers left behind and whose scoring process is gone."""
    orphans = []
    for each in psutil.process_iter():
        try:
            owner = each.environ().get(launch.MARK)
        except psutil.Error:
            continue
        if owner and not psutil.pid_exists(int(owner.partition("-")[0])):
            orphans.append(each)
    return orphans


def test_folders_of_killed_runs_are_removed_by_the_next(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        pass
    for owner in (ended.pid, os.getpid(), "somebody"):
        (tmp_path / f"retarget-bench-{owner}-x").mkdir()
    with files.scratch_folder() as own_folder:
        assert own_folder.is_dir()
    left = {each.name for each in tmp_path.iterdir()}
    assert left == {f"retarget-bench-{os.getpid()}-x", "retarget-bench-somebody-x"}


@pytest.mark.parametrize(
    ("prefix", "status"),
    [
        pytest.param("env FREE=1", "ok", marks=pytest.mark.slow),
        pytest.param("bwrap", "failed", marks=pytest.mark.skipif(not which("bwrap"), reason="needs bwrap")),
    ],
)
def test_methods_start_under_a_command(tmp_path, prefix, status):
    """Under bwrap nothing can be written that is not the method's own."""
    left = Path.home() / ".retarget-bench-hostile"
    try:
        plan = asked(tmp_path, "hostile[does=home]", "copy_rotations", clips=1, isolate=prefix)
        runner.run(plan, lambda done, total: None)
        assert left.exists() == (status == "ok")
    finally:
        left.unlink(missing_ok=True)
    results = _results(tmp_path)
    assert {each.status for each in results["hostile[does=home]"].entries} == {status}
    assert {each.status for each in results["copy_rotations"].entries} == {"ok"}


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("nosuch -x", "started under nosuch, which is not installed here"),
        (" ", "cannot be started under ' '; name a command"),
        ('"', "cannot be started under '\"'; name a command"),
    ],
)
def test_a_command_that_is_none_or_not_there_is_told(tmp_path, command, words):
    with pytest.raises(BenchError, match=words):
        runner.run(asked(tmp_path, "copy_rotations", isolate=command), lambda done, total: None)


@pytest.mark.slow
@pytest.mark.parametrize("where", ["", f"@{sys.executable}"], ids=["forked", "elsewhere"])
def test_a_hanging_method_ends_with_a_run_that_is_killed(tmp_path, where):
    """All processes but that of the method are killed at once."""
    method, data = HERE / "red_team" / "hostile.py", HERE / "toys" / "toy_cases.py"
    line = [sys.executable, "-m", "retarget_bench", "run", f"{method}[does=sleep]{where}", "-d", str(data)]
    line += ["-j", "1", "--out", str(tmp_path / "runs")]
    environment = os.environ | {
        "PYTHONPATH": str(HERE.parents[1]),
        "RETARGET_BENCH_NAP": str(tmp_path / "nap"),
    }
    with subprocess.Popen(
        line, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as run:
        deadline = time.monotonic() + 60
        while not (tmp_path / "nap").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        sleeper = int((tmp_path / "nap").read_text())
        for each in [*psutil.Process(run.pid).children(recursive=True), psutil.Process(run.pid)]:
            if each.pid != sleeper:
                each.kill()
    while psutil.pid_exists(sleeper) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not psutil.pid_exists(sleeper)
