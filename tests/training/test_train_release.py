"""``tools/train_release`` from end to end, with a toy in the place of the shipped methods."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import torch
from click.testing import CliRunner

from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import clips, prepare, train, weights
from retarget_bench.training.config import presets
from tests.in_process import carried_out_here, without_processes
from tools import train_release as release

TOYS = Path(__file__).parent / "toys"


@pytest.fixture
def released(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The command's options after the usual ones; gives the toy's place for shipped weights."""
    monkeypatch.setattr(registry, "_FILES", dict(registry._FILES))
    toy = shutil.copy(TOYS / "toy_trainee.py", tmp_path)
    for file in (toy, TOYS / "toy_walks.py"):
        registry.add_file(Path(file))
    for module in (clips, prepare):
        monkeypatch.setattr(module, "carried_out", carried_out_here)
    monkeypatch.setattr(train.log, "draw", lambda *_: None)
    monkeypatch.setattr(release, "TRAININGS", (release.Training("toy_trainee", 1, 1),))
    monkeypatch.setattr(release, "TINY", "toy_walks")
    monkeypatch.setattr(release, "run", lambda methods, **others: calls.append((methods, others)) or None)
    monkeypatch.setattr(release, "write_tables", lambda *_: None)
    calls: list[Any] = []

    def command(*words: str) -> list[Any]:
        calls.clear()
        with without_processes():
            result = CliRunner().invoke(
                release.command,
                ["--tiny", "--device", "cpu", "-j", "1", "--out", str(tmp_path / "out"), *words],
            )
        if result.exception and not isinstance(result.exception, SystemExit):
            raise result.exception
        return calls

    return command


def verdict(tmp_path: Path) -> Any:
    return json.loads((tmp_path / "out" / "toy_trainee" / "verdict.json").read_text())


def test_it_trains_ships_runs_and_goes_on(released: Any, tmp_path: Path) -> None:
    place = tmp_path / "weights" / "none"
    assert released()[0][1]["out"] == tmp_path / "out" / "results"
    first = verdict(tmp_path)
    assert first["steps"] == 2
    assert first["before"] is None
    assert weights.read(place).hash == weights.read(tmp_path / "out" / "toy_trainee").hash == first["hash"]
    assert "toy_trainee | 2" in (tmp_path / "out" / "summary.md").read_text()
    released()  # all is done: nothing is trained or judged again
    assert verdict(tmp_path) == first


def test_worse_weights_are_not_shipped(released: Any, tmp_path: Path) -> None:
    released()
    good = weights.read(tmp_path / "weights" / "none")
    worse = {"weight": torch.eye(3), "bias": torch.zeros(3)}
    weights.write(tmp_path / "weights", "none", worse, good.card)
    shutil.rmtree(tmp_path / "out")
    before = weights.read(tmp_path / "weights" / "none").hash
    released()
    again = verdict(tmp_path)
    assert again["before"] < again["after"]
    assert weights.read(tmp_path / "weights" / "none").hash == before
    assert weights.read_card(tmp_path / "out" / "toy_trainee").init == before


def test_an_interrupted_one_goes_on(released: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: Any) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(release, "validated", stopped)
        released()
    assert not (tmp_path / "out" / "toy_trainee" / "verdict.json").exists()
    trained = weights.read(tmp_path / "out" / "toy_trainee").hash
    with monkeypatch.context() as patch:
        patch.setattr(release, "train", stopped)  # it has ended already
        released()
    assert verdict(tmp_path)["hash"] == trained


def test_what_is_asked_for_must_be_there(released: Any) -> None:
    with pytest.raises(BenchError, match="trained are toy_trainee"):
        released("--only", "nobody")


def test_every_training_has_its_configs() -> None:
    for each in release.TRAININGS:
        method: Any = bound.method(Spec.parse(each.method)).built
        gpu, default = (presets(method)[name] for name in ("gpu", "default"))
        assert "quick" in presets(method)
        assert method.config.weights in method.shipped() or not method.shipped()
        assert (gpu.window, gpu.rate, gpu.validate) == (default.window, default.rate, 300)
    # A GPU is lent for half an hour: data made beforehand and tables made afterwards take none of it.
    assert sum(each.minutes for each in release.TRAININGS) <= 30


def test_every_method_with_shipped_weights_is_trained() -> None:
    trained = {Spec.parse(each.method).name for each in release.TRAININGS}
    folders = (Path(release.__file__).parents[1] / "methods").glob("*/weights/*.safetensors")
    assert trained >= {path.parents[1].name for path in folders}


def test_stages_are_trained_before_what_learns_with_them() -> None:
    order = [Spec.parse(each.method).name for each in release.TRAININGS]
    for place, each in enumerate(release.TRAININGS):
        for stage in bound.method(Spec.parse(each.method)).built.stages.values():
            assert stage.card.name in order[:place]
