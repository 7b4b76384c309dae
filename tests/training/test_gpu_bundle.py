"""What travels to a machine with a GPU, and the one command that runs there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
from pathlib import Path
from typing import Any

import pytest

from retarget_bench.errors import BenchError
from tools import gpu_plan

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="this is no checkout")


def bundle(folder: Path, *methods: str, **variables: object) -> subprocess.CompletedProcess[str]:
    without = {name: each for name, each in os.environ.items() if name != "RETARGET_BENCH_CMU"}
    return subprocess.run(
        [ROOT / "tools" / "gpu_bundle.sh", folder, *methods],
        env={**without, **{name: str(each) for name, each in variables.items()}},
        capture_output=True,
        text=True,
    )


def run(folder: Path, out: Path) -> str:
    """The command inside a bundle, with next to no training; what it prints."""
    result = subprocess.run(
        [folder / "tools" / "gpu_run.sh"],
        cwd=folder,
        env={**os.environ, "OUT": str(out), "PYTHON": sys.executable, "DATA": "puppets", "BUDGET": "2s"},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stdout
    return result.stdout


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def card(out: Path, method: str) -> Any:
    with tarfile.open(out / f"{method}.tar") as tar:
        member = tar.extractfile(f"{method}/weights.json")
        assert member is not None
        return json.load(member)


def test_a_bundle_is_the_code_and_the_weights_that_training_begins_with(tmp_path: Path) -> None:
    earlier, cmu = tmp_path / "out", tmp_path / "cmu"
    for each in (earlier, cmu):
        each.mkdir()
    (earlier / "humot.tar").write_bytes(b"of an earlier run")
    (cmu / "05_01.bvh").write_text("HIERARCHY")
    result = bundle(tmp_path / "bundle", "pan", "humot", CMU=cmu, EARLIER=earlier)
    assert result.returncode == 0, result.stderr
    names = files(tmp_path / "bundle")
    tensors = {name for name in names if name.endswith(".safetensors")}
    assert tensors == {"methods/pan/weights/puppets.safetensors"}
    assert {"earlier/humot.tar", "cmu.tar.xz", "METHODS", "tools/gpu_run.sh"} <= names
    packages = ("retarget_bench", "methods", "metrics", "datasets")
    listed = ["git", "-C", ROOT, "ls-tree", "-r", "-z", "--name-only", "HEAD", *packages]
    tracked = subprocess.run(listed, capture_output=True, text=True, check=True).stdout.split("\0")
    assert {name for name in tracked if name.endswith((".py", ".toml", ".csv"))} <= names
    assert "datasets/puppets/tiny/validation.npz" in names
    assert "datasets/puppets/tiny/test.npz" not in names
    others = [name for name in names if not name.startswith("datasets/puppets/tiny/")]
    assert sum((tmp_path / "bundle" / name).stat().st_size for name in others) < 10_000_000


def test_one_that_is_too_large_to_travel_is_told(tmp_path: Path) -> None:
    (tmp_path / "wheels").mkdir()
    with (tmp_path / "wheels" / "large.whl").open("wb") as file:
        file.truncate(40_000_000)
    result = bundle(tmp_path / "bundle", "humot", WHEELS=tmp_path / "wheels")
    assert result.returncode == 1
    assert "larger than 40 MB" in result.stderr


@pytest.mark.parametrize(
    ("methods", "variables", "words"),
    [
        (["nobody"], {}, "there is no method nobody"),
        ([], {}, "say a folder and at least one method"),
        (["pan"], {"CMU": "/no/such/folder"}, "CMU=/no/such/folder is no folder"),
    ],
)
def test_wrong_words_are_a_sentence(tmp_path: Path, methods: list[str], variables: Any, words: str) -> None:
    result = bundle(tmp_path / "bundle", *methods, **variables)
    assert (result.returncode, list(tmp_path.iterdir())) == (2, [])
    assert words in result.stderr


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    result = bundle(tmp_path, "pan")
    assert result.returncode == 2
    assert "is no bundle" in result.stderr
    assert files(tmp_path) == {"thesis.tex"}


def test_methods_with_parameters_bring_weights_of_their_own(tmp_path: Path) -> None:
    assert bundle(tmp_path / "bundle", "pan[parts=three]").returncode == 0
    tensors = {name for name in files(tmp_path / "bundle") if name.endswith(".safetensors")}
    assert tensors == {"methods/pan/weights/puppets_three.safetensors"}


def test_a_plan_begins_with_earlier_weights(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RETARGET_BENCH_CMU", "anywhere")
    assert gpu_plan.line("pan").split() == [
        *("pan", "pan", "-d", "puppets[bodies=200,size=large]", "-d", "cmu[bodies=200,own=false]"),
        *("--init", "puppets"),
    ]
    monkeypatch.setenv("DATA", "puppets")
    (tmp_path / "earlier" / "pan").mkdir(parents=True)
    assert gpu_plan.line("pan") == "pan pan -d puppets --init earlier/pan"
    assert gpu_plan.line("pan[parts=three]").endswith(" pan[parts=three] -d puppets --init puppets_three")
    with pytest.raises(BenchError, match="nobody: trained are paired, pan"):
        gpu_plan.line("nobody")


@pytest.mark.slow
def test_short_runs_add_up_and_a_method_that_fails_costs_itself_alone(tmp_path: Path) -> None:
    assert bundle(tmp_path / "first", "humot", "r2et").returncode == 0
    run(tmp_path / "first", tmp_path / "out")
    assert files(tmp_path / "out") == {"run.txt", "steps.txt", "humot.tar", "r2et.tar"}
    assert "humot, preset quick: windows a second" in (tmp_path / "out" / "steps.txt").read_text()
    with tarfile.open(tmp_path / "out" / "humot.tar") as tar:
        tar.extractall(tmp_path, filter="data")
    with tarfile.open(tmp_path / "out" / "r2et.tar", "w") as tar:
        tar.add(tmp_path / "humot", "r2et")  # another method's, which r2et refuses
    result = bundle(tmp_path / "second", "r2et", "humot", EARLIER=tmp_path / "out")
    assert result.returncode == 0
    output = run(tmp_path / "second", tmp_path / "again")
    assert "ended with status" in output
    assert files(tmp_path / "again") == {"run.txt", "humot.tar"}, "steps are timed by the first run alone"
    assert card(tmp_path / "again", "humot")["init"] == card(tmp_path / "out", "humot")["hash"]
