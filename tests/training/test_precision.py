"""Training in bfloat16: recorded when it is asked for, kept by a run that goes on, told on the card."""

import json

import pytest

from retarget_bench.errors import BenchError
from retarget_bench.training import request, weights


# ------------------------------------------------------------------------------------ what is asked for
def test_it_is_recorded_told_on_the_card_and_kept(toy_run, tmp_path):
    assert toy_run(precision="bfloat16", stop=17)[0] is None
    kept = request.read(tmp_path / "run")
    assert kept.precision == "bfloat16"
    assert kept.command.endswith("--precision bfloat16 --seed 0")
    toy_run(resume=True, precision="bfloat16")
    card = json.loads((tmp_path / "run" / "weights.json").read_text())
    assert card["recipe"]["precision"] == "bfloat16"
    assert "--precision bfloat16" in card["command"]
    toy_run("whole", precision="bfloat16")
    assert weights.read(tmp_path / "run").hash == weights.read(tmp_path / "whole").hash
    toy_run("full")
    assert weights.read(tmp_path / "run").hash != weights.read(tmp_path / "full").hash


def test_going_on_in_another_precision_is_refused(toy_run):
    toy_run(stop=17)
    with pytest.raises(BenchError, match="this run began with precision float32, not bfloat16"):
        toy_run(resume=True, precision="bfloat16")
