"""A real plug-in package is installed with pip and used; a broken one beside it breaks nothing."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from retarget_bench.cli import main
from retarget_bench.plugins import registry
from tests.in_process import without_processes

HERE = Path(__file__).parent
ROOT = HERE.parent
PACKAGES = ("retarget_bench_sway", "retarget_bench_broken")
Bench = subprocess.CompletedProcess[str]


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """A folder into which pip installed both packages."""
    if find_spec("setuptools") is None or find_spec("pip") is None:
        pytest.skip("installing the plug-ins needs setuptools and pip in this environment")
    sources = tmp_path_factory.mktemp("sources")
    shutil.copytree(HERE / "plugins", sources, dirs_exist_ok=True)
    unreadable = sources / "broken" / "retarget_bench_broken" / "unreadable.py"
    unreadable.write_text('"""Is no Python."""\n\ndef (:\n')
    target = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--no-deps",
        "--no-build-isolation",
        "--target",
        str(target),
    ]
    subprocess.run(
        [*command, str(sources / "sway"), str(sources / "broken")], check=True, capture_output=True
    )
    return target


@pytest.fixture
def bench(site, tmp_path, monkeypatch, capsys):
    """Runs ``bench`` with both packages installed, in an empty folder and without a new process."""
    before = set(sys.modules)
    monkeypatch.syspath_prepend(site)
    monkeypatch.chdir(tmp_path)
    registry._installed.cache_clear()

    def run(*arguments: str) -> Bench:
        with pytest.raises(SystemExit) as stopped:
            main(list(arguments))
        captured = capsys.readouterr()
        return Bench(arguments, int(stopped.value.code or 0), captured.out, captured.err)

    with without_processes():
        yield run
    registry._installed.cache_clear()
    for name in set(sys.modules) - before:
        if name.startswith(PACKAGES):
            del sys.modules[name]


def test_installed_plug_ins_are_listed_with_their_origin(site, tmp_path):
    """By a new process, as users have it."""
    completed = subprocess.run(
        [sys.executable, "-m", "retarget_bench", "list"],
        cwd=tmp_path,
        env={**os.environ, "COLUMNS": "200", "PYTHONPATH": os.pathsep.join([str(ROOT), str(site)])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed.returncode == 0, completed.stderr
    lines = {line.split()[0]: line for line in completed.stdout.splitlines() if line.startswith("  ")}
    assert "Copies the pose and lets the hips sway" in lines["sway"]
    assert lines["sway"].endswith("[retarget-bench-sway 1.2.3]")
    assert lines["lean"].endswith("[retarget-bench-sway 1.2.3]")
    assert lines["beam"].endswith("[retarget-bench-sway 1.2.3]")
    assert "copy_rotations" in lines
    assert "Raises when it is imported." in lines["raises"]
    assert "no module retarget_bench_broken.nowhere" in lines["nowhere"]
    assert "cannot be read" in lines["unreadable"]


def test_a_run_with_everything_uses_the_good_and_names_the_broken(bench, tmp_path):
    result = bench("run", "-d", "beam[frames=12]", "-j", "1")
    assert result.returncode == 0, result.stderr
    assert "sway" in result.stdout
    assert "copy_rotations" in result.stdout
    for phrase in (
        "method raises (retarget-bench-broken 0.0.7) could not be imported: RuntimeError: no licence file",
        "method nowhere (retarget-bench-broken 0.0.7) could not be imported: ModuleNotFoundError",
        "method nothing (retarget-bench-broken 0.0.7): module retarget_bench_broken has no plugin",
        "metric unreadable (retarget-bench-broken 0.0.7) could not be imported: SyntaxError",
    ):
        assert phrase in result.stderr
    assert "Traceback" not in result.stderr
    table = bench("table", "--all")
    assert table.returncode == 0, table.stderr
    assert "lean" in table.stdout


@pytest.mark.parametrize("name", ["sway", "lean", "beam"])
def test_installed_plug_ins_keep_the_contract(bench, name):
    result = bench("test", name, *(() if name == "beam" else ("-d", "beam")))
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("info", "raises"), "RuntimeError: no licence file found"),
        (("test", "nowhere"), "retarget-bench-broken 0.0.7"),
        (("run", "raises", "-d", "beam"), "RuntimeError: no licence file found"),
        (("run", "sway", "-d", "unbuilt"), "could not be built as unbuilt: OSError: the disk is elsewhere"),
        (("run", "sway", "-d", "beam", "--metrics", "unreadable"), "SyntaxError"),
    ],
)
def test_asking_for_a_broken_plug_in_is_one_sentence(bench, arguments, message):
    result = bench(*arguments)
    assert result.returncode == 2
    assert message in result.stderr
    assert "Traceback" not in result.stderr


def test_a_method_that_crashes_costs_its_own_rows_only(bench):
    result = bench("run", "crashes", "sway", "-d", "beam", "-j", "1")
    assert result.returncode == 0, result.stderr
    assert "Traceback" not in result.stderr
    assert "sway" in result.stdout
    failed = bench("test", "crashes", "-d", "beam")
    assert failed.returncode == 1
    assert "ZeroDivisionError: a bone of length 0 (crashes.py:13)" in failed.stdout
