"""The command line: what it prints, how it fails, and what it leaves behind."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from retarget_bench import cli
from retarget_bench.commands.plugins import plugin_source
from retarget_bench.errors import BenchError
from retarget_bench.plugins import named, registry

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    """Every test has an empty folder of its own, and no plug-in files from another one."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_FILES", {})


@pytest.fixture
def bows(tmp_path) -> list[str]:
    """The template data set, as options that make it known."""
    (tmp_path / "bows.py").write_text(plugin_source("dataset", "bows"))
    return ["-d", "bows.py"]


def test_help_names_every_command_with_the_line_of_its_own_help(bench):
    result = bench("--help")
    assert result.code == 0
    for name in cli.COMMANDS:
        assert re.search(rf"^  {name}  ", result.out, re.MULTILINE)
        assert bench(name, "--help").code == 0


@pytest.mark.parametrize(("typed", "meant"), [("rnu", "run"), ("lst", "list"), ("retargt", "retarget")])
def test_a_mistyped_command_suggests_the_near_one(bench, typed, meant):
    result = bench(typed)
    assert result.code == 2
    assert f"no command is called '{typed}'; did you mean {meant}" in result.err


def test_root_is_short_for_the_data_sets_parameter():
    assert str(named.dataset("mixamo[structure=S28]", "/x")) == "mixamo[root=/x,structure=S28]"
    assert str(named.dataset("mixamo[root=/a]", "/b")) == "mixamo[root=/b]"
    assert str(named.dataset("puppets")) == "puppets"


# ---------------------------------------------------------------------------------------------- failing
def test_an_error_is_one_line_and_status_2(bench):
    result = bench("info", "no_such_thing_at_all")
    assert result.code == 2
    assert result.err.startswith("bench: nothing is called 'no_such_thing_at_all'; known are ")
    assert result.err.count("\n") == 1
    assert result.out == ""


def test_the_traceback_is_there_for_those_who_ask(monkeypatch):
    monkeypatch.setenv("RETARGET_BENCH_TRACEBACK", "")
    with pytest.raises(BenchError, match="nothing is called"):
        cli.main(["--traceback", "info", "no_such_thing_at_all"])


@pytest.mark.parametrize(
    ("command", "message"), [("run", "continues from there"), ("list", "interrupted.")]
)
def test_an_interrupt_is_a_sentence_and_status_130(bench, monkeypatch, command, message):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(registry, "names", interrupted)
    monkeypatch.setattr(registry, "working", interrupted)
    result = bench(command)
    assert result.code == 130
    assert message in result.err
    assert "Traceback" not in result.err


SLEEPS = """
import os, pathlib, time

if ("RETARGET_BENCH_WORKER" not in os.environ) == {here}:
    pathlib.Path("here").touch()
    time.sleep(60)
"""


def sleeping_run(folder: Path, bows: Sequence[str], here: bool) -> subprocess.Popen[str]:
    """A run that sleeps, in the command or in a worker; its temporary files are in ``folder / "tmp"``."""
    (folder / "slow.py").write_text(plugin_source("method", "slow") + SLEEPS.format(here=here))
    (folder / "tmp").mkdir()
    line = [sys.executable, "-m", "retarget_bench", "run", "slow.py"]
    process = subprocess.Popen(
        [*line, *bows],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(folder / "tmp")},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    for _ in range(600):
        if (folder / "here").exists():
            return process
        time.sleep(0.05)
    process.kill()
    raise TimeoutError("the run did not come to sleep")


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
@pytest.mark.parametrize("here", [True, False], ids=["in the command", "in a worker"])
def test_ctrl_c_ends_all_processes_with_one_sentence(tmp_path, bows, here):
    process = sleeping_run(tmp_path, bows, here)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert err.strip() == (
        "bench: interrupted. What was finished is kept; the same command continues from there."
    )


@pytest.mark.skipif(os.name != "posix", reason="sends SIGTERM")
def test_a_run_that_is_terminated_leaves_nothing(tmp_path, bows):
    with sleeping_run(tmp_path, bows, here=False) as process:
        assert list((tmp_path / "tmp").glob("retarget-bench-*"))
        process.terminate()
        assert process.wait(timeout=30) == 143
    assert not list((tmp_path / "tmp").glob("retarget-bench-*"))


def test_a_closed_pipe_is_no_error():
    command = f"{sys.executable} -m retarget_bench list | head -n 1"
    completed = subprocess.run(command, shell=True, cwd=ROOT, capture_output=True, text=True, check=True)
    assert completed.stdout == "Methods\n"
    assert completed.stderr == ""


# ------------------------------------------------------------------------------------- list, info, new
def test_list_shows_one_kind_or_all(bench, bows):
    registry.add_file("bows.py")
    everything = bench("list").out
    assert [line for line in everything.splitlines() if line and line[0] != " "] == [
        "Methods",
        "Metrics",
        "Data sets",
        "Post-processors (METHOD+NAME)",
    ]
    only = bench("list", "datasets").out
    assert only.startswith("Data sets\n")
    assert re.search(
        r"^  bows +One line that says what the data are; .*\s+\[.*bows.py\]$", only, re.MULTILINE
    )
    assert "copy_rotations" not in only


def test_info_shows_parameters_and_formulas(bench):
    method = " ".join(bench("info", "copy_rotations").out.split())
    assert re.search(r"Parameters root_rule=none\|height\S* \(default \w+\): length whose ratio", method)
    few, full = (bench("info", "pan", *words).out for words in ((), ("--all",)))
    assert "and 15 more: bench info pan --all" in few
    lines = [registry.load("methods", "pan").card.parameters[name] for name in ("variant", "velocity")]
    assert [[line in text for line in lines] for text in (few, full)] == [[True, False], [True, True]]
    metric = bench("info", "position").out
    assert "mpjpe_h.world" in metric
    assert "formula: 100 * mean over frames and joints of |p - g| / h" in metric
    assert bench("info").code == 2


@pytest.mark.parametrize("columns", [80, 110])
@pytest.mark.parametrize("words", [["list"], ["info", "humot"], ["info", "ik"], ["info", "contact"]])
def test_lists_and_descriptions_fit_the_terminal(monkeypatch, words, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    result = CliRunner().invoke(cli.group, words)
    assert result.exit_code == 0
    assert columns - 15 < max(map(len, result.output.splitlines())) <= columns


@pytest.mark.parametrize("kind", ["method", "metric", "dataset", "post"])
def test_a_new_plug_in_runs_as_it_is(bench, bows, kind):
    result = bench("new", kind, "mine")
    assert result.code == 0
    assert "wrote mine.py" in result.out
    text = Path("mine.py").read_text()
    assert "my_" not in text.replace("my_plugin", "")
    assert "class Mine(" in text
    tested = bench("test", "mine.py", *bows)
    assert tested.code == 0, tested.out + tested.err
    assert "FAILED" not in tested.out


def test_new_overwrites_nothing(bench):
    Path("mine.py").write_text("precious")
    assert bench("new", "method", "mine").code == 2
    assert Path("mine.py").read_text() == "precious"
    Path("wide").mkdir()
    assert "exists already" in bench("new", "metric", "wide", "--package").err
    assert list(Path("wide").iterdir()) == []


@pytest.mark.parametrize("name", ["Mine", "7up", "a-b", "", "x" * 60, "../x"])
def test_new_refuses_names_that_are_no_module(bench, name):
    assert "is no name for a plug-in" in bench("new", "method", name).err
    assert list(Path().iterdir()) == []


def test_new_refuses_names_that_are_taken(bench):
    assert "method copy_rotations (built-in) has this name" in bench("new", "method", "copy_rotations").err


@pytest.mark.parametrize(
    ("kind", "group"), [("method", "methods"), ("dataset", "datasets"), ("post", "posts")]
)
def test_a_new_package_has_an_entry_point_and_a_test(bench, kind, group):
    import tomllib

    assert bench("new", kind, "my_own", "--package").code == 0
    project = tomllib.loads(Path("my_own/pyproject.toml").read_text())
    assert project["project"]["name"] == "retarget-bench-my-own"
    assert project["project"]["entry-points"] == {
        f"retarget_bench.{group}": {"my_own": "retarget_bench_my_own:plugin"}
    }
    assert project["tool"]["setuptools"]["packages"] == ["retarget_bench_my_own"]
    assert Path("my_own/retarget_bench_my_own/__init__.py").read_text() == plugin_source(kind, "my_own")
    assert f'assert_contract("{group}", "my_own")' in Path("my_own/tests/test_my_own.py").read_text()


# ----------------------------------------------------------------------------------------- export-cases
def test_exported_cases_hold_inputs_and_no_reference(bench, bows):
    result = bench("export", "--questions", "bows.py[frames=12]", "out")
    assert result.code == 0, result.err
    manifest = json.loads(Path("out/manifest.json").read_text())
    assert manifest["dataset"] == "bows[frames=12]"
    data = registry.create("datasets", "bows[frames=12]")
    infos = [info for split in ("self", "intra") for info in data.cases("retarget", split)]
    assert [case["id"] for case in manifest["cases"]] == [info.id for info in infos]
    for info, facts in zip(infos, manifest["cases"], strict=True):
        case = data.load(info)
        source = np.load(f"out/{facts['source_file']}.npz")
        assert np.array_equal(source["rotations"], case.source.rotations)
        assert (float(source["fps"]), facts["frames"]) == (30.0, 12)
        target = np.load(f"out/{facts['target_file']}.npz")
        assert np.array_equal(target["offsets"], case.target.skeleton.offsets)
        assert "rotations" not in target
        assert Path(f"out/{facts['source_file']}.bvh").read_text().startswith("HIERARCHY")
    files = [path for path in Path("out").rglob("*") if path.is_file()]
    assert len(files) == 1 + 2 * (4 + 2)  # the manifest; 2 figures x 2 clips, and 2 figures, twice each


def test_predictions_made_from_an_export_are_scored_on_its_split_alone(bench, bows):
    assert bench("export", "--questions", "bows.py[frames=12]", "out", "-s", "intra").code == 0
    for case in json.loads(Path("out/manifest.json").read_text())["cases"]:
        source = np.load(f"out/{case['source_file']}.npz")
        root = np.tile([[0.0, 0.5, 0.0]], (case["frames"], 1))
        np.savez(f"out/{case['prediction']}.npz", rotations=source["rotations"], root=root)
    result = bench("score", "out", "--name", "theirs", "--metrics", "position", *bows, "-j", "1")
    assert result.code == 0, result.err
    assert "theirs" in result.out
    (rows,) = Path("runs").rglob("theirs.csv")
    assert rows.parent.name == "intra"
    cells = [line.split(",") for line in rows.read_text().splitlines()]
    hips = {row[0]: float(row[-1]) for row in cells if "root_path.vertical" in row}
    data = registry.create("datasets", "bows[frames=12]")
    for info in data.cases("retarget", "intra"):
        case = data.load(info)
        off = abs(float(case.reference.root[0, 1]) - 0.5)
        assert hips[info.id] == pytest.approx(100 * off / case.target.height, rel=1e-5)
    result = bench("score", "out", "--name", "theirs", "--metrics", "position", *bows, "-s", "cross,self")
    assert result.code == 2
    assert "manifest.json lists no case of cross or self; there are those of intra" in result.err
