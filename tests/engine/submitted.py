"""Submissions of toy results as fixtures, and ways to change their files."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from retarget_bench.cli import main
from retarget_bench.exchange.card import CARD, FILL_IN
from retarget_bench.exchange.checking import check
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
    with without_processes():
        assert (
            bench("run", "copy_rotations", "ik", "-d", str(TOYS / "toy_cases.py"), "--out", str(out)) == 0
        )
    return out


def make(folder: Path, runs: Path, name: str, *options: str) -> Path:
    """A submission of one method by the command."""
    assert bench("submit", str(folder), "--make", name, "--results", str(runs), *options) == 0
    return folder


COSTS = {"parameters": "0", "training_hours": "0", "peak_memory_mb": "12.5", "lookahead_frames": '"clip"'}


def filled_in(folder: Path) -> Path:
    text = (folder / CARD).read_text(encoding="utf-8")
    for name, number in {**COSTS, "frames_per_second": "100"}.items():
        text = text.replace(f'{name} = "{FILL_IN}"', f"{name} = {number}")
    (folder / CARD).write_text(text.replace(FILL_IN, "A. Author"), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def unfilled(tmp_path_factory: pytest.TempPathFactory, runs: Path) -> Path:
    """A submission of ik, with what is left to fill in."""
    folder = tmp_path_factory.mktemp("made") / "ik"
    return without_predictions(make(folder, runs, "ik"))


@pytest.fixture
def sound(tmp_path: Path, unfilled: Path) -> Path:
    return filled_in(shutil.copytree(unfilled, tmp_path / "all" / "ik"))


def without_predictions(folder: Path) -> Path:
    """The submission with its rows alone."""
    for path in folder.glob("*/retarget/*/*/"):
        shutil.rmtree(path)
    return folder


def errors(folder: Path) -> list[str]:
    return check(folder)[0]


def rewrite(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def some(folder: Path, split: str, suffix: str) -> Path:
    (path,) = folder.glob(f"*/retarget/{split}/ik{suffix}")
    return path


def predictions(runs: Path, folder: Path) -> None:
    """The stored predictions of ik, as a submission has them."""
    for path in runs.glob("*/retarget/*/ik/"):
        shutil.copytree(path, folder / path.relative_to(runs))
