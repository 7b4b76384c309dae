"""Means of weights: shares, counters, cards, and runs that began elsewhere."""

from __future__ import annotations

import re

import pytest
import torch

from retarget_bench.errors import BenchError
from retarget_bench.plugins import bound
from tools.average_weights import card, command, mean


def test_shares_are_those_of_the_run_and_counters_are_not_averaged():
    before = {"weight": torch.tensor([1.0, 2.0]), "steps": torch.tensor(3)}
    after = {"weight": torch.tensor([2.0, 0.0]), "steps": torch.tensor(9)}
    average = mean(before, after, 0.75)
    assert average["weight"].tolist() == [1.75, 0.5]
    assert average["steps"].item() == 9
    assert average["steps"].dtype == torch.int64
    assert mean(before, after, 0.0)["weight"].tolist() == [1.0, 2.0]
    assert mean(before, after, 1.0)["weight"].tolist() == [2.0, 0.0]


def test_the_card_says_what_was_averaged_and_has_no_hash_of_another():
    averaged = card({"hash": "aa", "schema": 1, "init": "bb", "notes": ["not on dogs"], "steps": 5}, 0.7)
    assert averaged["notes"][0].startswith("a mean of weights: 0.7 of this training's (aa), 0.3 of those")
    assert "(bb)" in averaged["notes"][0]
    assert averaged["notes"][1:] == ["not on dogs"]
    assert not {"hash", "schema"} & averaged.keys()
    assert averaged["steps"] == 5


@pytest.mark.parametrize("method", ["ik", "nkn_cross[weights=others]"])
def test_methods_without_weights_are_refused(method, tmp_path):
    with pytest.raises(BenchError, match=re.escape(f"{method} has no shipped weights")):
        command.main([method, str(tmp_path)], standalone_mode=False)


def test_a_run_that_began_elsewhere_is_refused(tmp_path):
    from retarget_bench.plugins.spec import Spec
    from retarget_bench.training import weights

    shipped = weights.read(bound.method(Spec("pan")).built.shipped()["puppets"])
    weights.write(tmp_path, "weights", shipped.tensors, {**shipped.card, "init": "0" * 16})
    with pytest.raises(BenchError, match="did not begin from the shipped weights of pan, but from 0000"):
        command.main(["pan", str(tmp_path)], standalone_mode=False)
