"""Averages of weights: over the steps of a training, and over two trainings."""

from __future__ import annotations

import dataclasses
import json
import re

import numpy as np
import pytest
import torch
from torch import nn

from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import log, loop, run_folder, weights
from retarget_bench.training.record import Record
from retarget_bench.training.weight_average import WeightAverage
from tools.average_weights import card, command, mean

DECAY = 0.8


@pytest.fixture
def averaged_run(toy_run, monkeypatch):
    """``toy_run`` with an average of weights in all presets."""
    presets = type(bound.method(Spec("toy_trainee")).built).presets
    averaged = {name: dataclasses.replace(each, average=DECAY) for name, each in presets.items()}
    monkeypatch.setattr(type(bound.method(Spec("toy_trainee")).built), "presets", averaged)
    return toy_run


def state(folder):
    return run_folder.tensors(folder, run_folder.read(folder))


def part(folder, head):
    return {key.removeprefix(head): x for key, x in state(folder).items() if key.startswith(head)}


def same(tensors, expected):
    assert tensors.keys() == expected.keys()
    for name in tensors:
        assert torch.equal(tensors[name], expected[name]), name


def noted(folder):
    """The parameters that each step began with, by step; as the toy notes them."""
    lines = [json.loads(line) for line in (folder / "rank-0.jsonl").read_text().splitlines()]
    return {int(step): np.array(numbers[:16]) for step, *numbers in lines}


def test_it_is_the_average_written_out(averaged_run, tmp_path, monkeypatch):
    monkeypatch.setenv("TOY_DUMP", str(tmp_path))
    averaged_run(budget="24it")
    begun, averaged = noted(tmp_path), part(tmp_path / "run", "average/")
    last = part(tmp_path / "run", "modules/")
    names = ["map.weight", "map.bias", "critic.weight", "critic.bias"]
    assert set(averaged) == set(names)
    after = [*(begun[step] for step in range(1, 24)), torch.cat([last[n].flatten() for n in names]).numpy()]
    average = begun[0]
    for step, now in enumerate(after, 1):
        decay = min(DECAY, (1 + step) / (10 + step))
        average = decay * average + (1 - decay) * now
    torch.testing.assert_close(
        torch.cat([averaged[name].flatten() for name in names]).double(),
        torch.from_numpy(average),
        rtol=1e-5,
        atol=1e-6,
    )


def test_training_goes_on_from_the_weights_themselves(toy_run, tmp_path, monkeypatch):
    """Losses and weights are the same, to the last bit, with an average and without."""
    toy_run("plain", seed=4)
    built = type(bound.method(Spec("toy_trainee")).built)
    averaged = {name: dataclasses.replace(each, average=DECAY) for name, each in built.presets.items()}
    monkeypatch.setattr(built, "presets", averaged)
    toy_run("averaged", seed=4)
    for head in ("modules/", "optimisers/"):
        same(part(tmp_path / "plain", head), part(tmp_path / "averaged", head))
    losses = [
        [(row["step"], row["generator.rebuilt"], row["critic.told"]) for row in log.read(tmp_path / name)]
        for name in ("plain", "averaged")
    ]
    assert losses[0] == losses[1]
    assert weights.read(tmp_path / "plain").hash != weights.read(tmp_path / "averaged").hash


@pytest.mark.parametrize("stop", [1, 15, 30])
def test_interrupted_and_resumed_it_is_the_uninterrupted_average(averaged_run, tmp_path, monkeypatch, stop):
    averaged_run("whole")
    monkeypatch.setattr(loop, "SAVED", 0.0)
    averaged_run("cut", stop=stop)
    averaged_run("cut", resume=True)
    same(state(tmp_path / "cut"), state(tmp_path / "whole"))
    assert weights.read(tmp_path / "cut").hash == weights.read(tmp_path / "whole").hash


def test_the_average_is_validated_and_kept_and_buffers_are_as_they_are(averaged_run, tmp_path, monkeypatch):
    method, snapshots = type(bound.method(Spec("toy_trainee")).built), []
    retarget = method.retarget

    def recorded(self, source, target, *, context):
        snapshots.append({name: each.clone() for name, each in self.tensors.items()})
        return retarget(self, source, target, context=context)

    monkeypatch.setattr(method, "retarget", recorded)
    averaged_run(budget="15it")
    average = part(tmp_path / "run", "average/")
    assert not torch.equal(average["map.weight"], part(tmp_path / "run", "modules/")["map.weight"])
    for tensors in (snapshots[-1], part(tmp_path / "run", "best/")):
        same(dict(tensors), {name: average[f"map.{name}"] for name in ("weight", "bias")})
    assert "critic.history" not in average
    card = json.loads((tmp_path / "run" / "weights.json").read_text())
    assert card["recipe"]["average"] == DECAY


def test_training_on_begins_with_the_average(averaged_run, tmp_path, monkeypatch):
    averaged_run("first")
    monkeypatch.setenv("TOY_DUMP", str(tmp_path))
    averaged_run("second", init=str(tmp_path / "first"), budget="2it")
    tensors = weights.read(tmp_path / "first").tensors
    expected = torch.cat([tensors["weight"].flatten(), tensors["bias"]]).numpy()
    np.testing.assert_array_equal(noted(tmp_path)[0][:12].astype(np.float32), expected)


def test_exchanged_and_exchanged_back_weights_are_where_they_were():
    modules = nn.Linear(2, 2)
    average = WeightAverage(modules, DECAY)
    begun = modules.weight.detach().clone()
    with torch.no_grad():
        modules.weight += 1.0
    now, place = modules.weight.detach().clone(), modules.weight.data_ptr()
    with average.in_place():
        assert torch.equal(modules.weight, begun)
        assert modules.weight.data_ptr() != place
    assert modules.weight.data_ptr() == place
    assert torch.equal(modules.weight, now)
    assert torch.equal(average.state()["weight"], begun)


def test_an_error_while_exchanged_leaves_the_weights():
    modules = nn.Linear(2, 2)
    place = modules.weight.data_ptr()
    with pytest.raises(KeyboardInterrupt), WeightAverage(modules, DECAY).in_place():
        raise KeyboardInterrupt
    assert modules.weight.data_ptr() == place


def test_what_reproduces_a_paper_has_no_average_and_what_is_ours_has_one():
    names, _ = registry.working("methods")
    presets_of = {}
    for name in names:
        built = bound.method(Spec(name)).built
        if getattr(built, "presets", None):
            presets_of[name] = built.presets
    assert {"pan", "humot", "nkn", "smrm", "pmnet", "r2et", "san", "same", "paired"} <= set(presets_of)
    for name, presets in presets_of.items():
        assert presets["default"].average > 0, name
        if name != "paired":  # it has no paper
            assert presets["paper"].average == 0, name


def test_without_validation_the_last_average_is_exported(averaged_run, tmp_path):
    averaged_run(data="toy_walks[kind=unwatched]")
    tensors, average = weights.read(tmp_path / "run").tensors, part(tmp_path / "run", "average/")
    same(dict(tensors), {name: average[f"map.{name}"] for name in ("weight", "bias")})


def test_an_update_reads_no_number_of_the_device():
    """On ``meta``, where there are shapes and no numbers, whatever copies one to the host raises."""
    modules = nn.Linear(2, 2, device="meta")
    average = WeightAverage(modules, DECAY)
    average.update(1)
    with average.in_place():
        pass
    with pytest.raises((NotImplementedError, RuntimeError)):
        float(modules.weight.detach().sum())


# ----------------------------------------------------------------------------------- means of two trainings
def test_shares_are_those_of_the_run_and_counters_are_not_averaged():
    before = {"weight": torch.tensor([1.0, 2.0]), "steps": torch.tensor(3)}
    after = {"weight": torch.tensor([2.0, 0.0]), "steps": torch.tensor(9)}
    average = mean(before, after, 0.75)
    assert average["weight"].tolist() == [1.75, 0.5]
    assert average["steps"].item() == 9
    assert average["steps"].dtype == torch.int64
    assert mean(before, after, 0.0)["weight"].tolist() == [1.0, 2.0]
    assert mean(before, after, 1.0)["weight"].tolist() == [2.0, 0.0]


def test_the_card_says_what_was_averaged():
    trained = Record(
        method="m", version="1", facts={}, hash="aa", init="bb", notes=["not on dogs"], steps=5
    )
    averaged = card(trained, 0.7)
    assert averaged.notes[0].startswith("a mean of weights: 0.7 of this training's (aa), 0.3 of those")
    assert "(bb)" in averaged.notes[0]
    assert averaged.notes[1:] == ["not on dogs"]
    assert averaged.steps == 5


@pytest.mark.parametrize("method", ["ik", "nkn_cross[weights=others]"])
def test_methods_without_weights_are_refused(method, tmp_path):
    with pytest.raises(BenchError, match=re.escape(f"{method} has no shipped weights")):
        command.main([method, str(tmp_path)], standalone_mode=False)


def test_a_run_that_began_elsewhere_is_refused(tmp_path):
    shipped = weights.read(bound.method(Spec("pan")).built.shipped()["puppets"])
    weights.write(tmp_path, "weights", shipped.tensors, dataclasses.replace(shipped.card, init="0" * 16))
    with pytest.raises(BenchError, match="did not begin from the shipped weights of pan, but from 0000"):
        command.main(["pan", str(tmp_path)], standalone_mode=False)
