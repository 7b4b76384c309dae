"""Submissions of toy results as fixtures, and ways to change their files."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from retarget_bench.cli import main
from retarget_bench.exchange.submission.checking import check
from retarget_bench.exchange.submission.making import FILL_IN, make
from tests.in_process import without_processes

TOYS = Path(__file__).parent / "toys"


def bench(*arguments: str) -> int:
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    return int(stop.value.code or 0)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two methods on six toy cases."""
    out = tmp_path_factory.mktemp("submitted") / "runs"
    plugins = ("--plugin", str(TOYS / "toy_cases.py"))
    with without_processes():
        assert bench("run", "copy_rotations", "ik", "-d", "toy_cases", "--out", str(out), *plugins) == 0
    return out


def filled_in(folder: Path) -> Path:
    for name in ("submission.toml", "CARD.md"):
        text = (folder / name).read_text(encoding="utf-8")
        (folder / name).write_text(text.replace(FILL_IN, "A. Author"), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, runs: Path) -> Path:
    """A submission of ik, with what is left to fill in."""
    folder = tmp_path_factory.mktemp("made") / "ik"
    make(folder, runs, "ik")
    return folder


@pytest.fixture
def sound(tmp_path: Path, made: Path) -> Path:
    return filled_in(shutil.copytree(made, tmp_path / "all" / "ik"))


def errors(folder: Path) -> list[str]:
    return [finding.text for finding in check(folder) if finding.level == "error"]


def rewrite(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def some(folder: Path, split: str, suffix: str) -> Path:
    (path,) = folder.glob(f"results/*/retarget/{split}/ik{suffix}")
    return path


def predictions(runs: Path, folder: Path) -> None:
    """The stored predictions of ik, as a submission has them."""
    (folder / "predictions").mkdir()
    for path in runs.glob("*/retarget/*/ik/*.npz"):
        shutil.copy(path, folder / "predictions")
