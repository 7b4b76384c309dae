"""``bench train`` as processes: killed and resumed, and several that train together."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import torch

from retarget_bench.cli import main
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import clips, log, run_folder, weights
from retarget_bench.training.gather import gather
from tests.in_process import carried_out_here

TOYS = Path(__file__).parent / "toys"
TRAINEE, WALKS = str(TOYS / "toy_trainee.py"), str(TOYS / "toy_walks.py")
TRAIN = [
    "train",
    *("-j", "1", "--device", "cpu"),
]
PATIENCE = 600
DRAW = log.draw  # toy_run leaves the picture out


def start(*command, **environment):
    settings = {**os.environ, "OMP_NUM_THREADS": "1", **environment}
    return subprocess.Popen(
        [sys.executable, *command], env=settings, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def bench(*arguments):
    return start("-m", "retarget_bench", *TRAIN, *arguments)


def torchrun(words, environment):
    """Two processes by the command that people use."""
    here = ["--standalone", "--nproc-per-node", "2", "--max-restarts", "1"]
    return start("-m", "torch.distributed.run", *here, "-m", "retarget_bench", *words, **environment)


def ended(process):
    out, err = process.communicate(timeout=PATIENCE)
    return process.returncode, out, err


def rows(folder):
    return [{name: text for name, text in row.items() if name != "seconds"} for row in log.read(folder)]


@pytest.mark.slow
def test_a_killed_run_goes_on_as_if_it_had_not_been(toy_run, tmp_path, monkeypatch, capsys):
    toy_run("whole")
    cut = tmp_path / "cut"
    process = bench(f"{TRAINEE}[pause=0.04]", "-d", WALKS, "--out", str(cut))
    until = time.monotonic() + PATIENCE
    while not list(cut.glob("step-*.safetensors")) and process.poll() is None and time.monotonic() < until:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert process.returncode == -signal.SIGKILL
    assert 0 < run_folder.read(cut).steps < 40
    monkeypatch.setattr(log, "draw", DRAW)
    capsys.readouterr()
    with pytest.raises(SystemExit) as stopped:
        main([*TRAIN, "--resume", "--out", str(cut)])
    out, err = capsys.readouterr()
    assert not stopped.value.code, err
    assert rows(cut) == rows(tmp_path / "whole")
    assert weights.read(cut).hash == weights.read(tmp_path / "whole").hash
    assert f"{TRAINEE}[pause=0.04,weights={cut}]" in out
    assert (cut / "loss.png").exists()


# --------------------------------------------------------------------------------- several processes
@pytest.fixture(scope="module", params=["agent", pytest.param("torchrun", marks=pytest.mark.slow)])
def pair(request, tmp_path_factory):
    """Two processes undisturbed, and two of which one is killed in step 23 and started again."""
    folder = tmp_path_factory.mktemp("pair")
    runs = []
    for name, does in (("whole", ""), ("killed", "[does=kill]")):
        (folder / f"{name}-dump").mkdir()
        arguments = [
            f"{TOYS / 'toy_trainee.py'}{does}",
            "-d",
            str(TOYS / "toy_walks.py"),
            "--out",
            str(folder / name),
            "--seed",
            "5",
        ]
        environment = {"TOY_DUMP": str(folder / f"{name}-dump")}
        runs.append({"words": [*TRAIN, *arguments], "environment": environment})
    if request.param == "torchrun":
        started = [torchrun(**run) for run in runs]
    else:
        started = [start("-m", "tests.training.train_together", *map(json.dumps, runs))]
    for process in started:
        status, _, err = ended(process)
        assert status == 0, err
    return folder


def noted(folder, rank):
    """The weights that each step of a process began with, in the order in which it did them."""
    lines = (folder / f"rank-{rank}.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


def test_a_killed_process_costs_nothing_but_time(pair):
    assert rows(pair / "killed") == rows(pair / "whole")
    folders = (pair / "killed", pair / "whole")
    state, expected = (run_folder.tensors(each, run_folder.read(each)) for each in folders)
    assert state.keys() == expected.keys()
    assert all(torch.equal(state[name], expected[name]) for name in state)
    assert weights.read(pair / "killed").hash == weights.read(pair / "whole").hash
    steps = [line[0] for line in noted(pair / "killed-dump", 1)]
    assert steps == [*range(23), *range(15, 40)]


@pytest.mark.parametrize("name", ["whole", "killed"])
def test_every_process_has_the_same_parameters_in_every_step(pair, name):
    first, second = ({k: w for k, *w in noted(pair / f"{name}-dump", rank)} for rank in (0, 1))
    assert first.keys() == second.keys() == set(range(40))
    assert first == second


def test_the_gradient_is_the_mean_over_the_batches_of_all_processes(pair, toy_plugins, monkeypatch):
    """The first step by hand: Adam's first step is the sign of the mean gradient, nearly."""
    monkeypatch.setattr(clips, "carried_out", carried_out_here)
    built = registry.create("methods", "toy_trainee")
    config = built.presets["default"]
    training_data = gather(Spec("toy_walks"), Spec("toy_trainee"), 30.0, 1, lambda *_: None)
    torch.manual_seed(5)
    module = built.training_module(training_data, config)
    parameters = list(module.modules["map"].parameters())
    total = [torch.zeros_like(each) for each in parameters]
    for rank in (0, 1):
        sequence = np.random.SeedSequence([5, 0, rank])
        torch.manual_seed(int(sequence.generate_state(1, np.uint64)[0] >> np.uint64(1)))
        batch = module.draw(np.random.default_rng(sequence), config.batch // 2)
        terms = module.losses("generator", {"root": torch.from_numpy(batch["root"])}, {})
        grads = torch.autograd.grad(sum(terms.values()), parameters)
        total = [t + g / 2 for t, g in zip(total, grads, strict=True)]
    norm = torch.cat([each.flatten() for each in total]).norm()
    rate = config.rate_at(0, 0.0)
    expected = []
    for p, g in zip(parameters, total, strict=True):
        clipped = g * min(1.0, 1.0 / (float(norm) + 1e-6))
        expected += (p - rate * clipped / (clipped.abs() + 1e-8)).flatten().tolist()
    after = noted(pair / "whole-dump", 0)[1]
    assert after[0] == 1
    np.testing.assert_allclose(after[1 : 1 + len(expected)], expected, rtol=1e-5, atol=1e-6)
    row = rows(pair / "whole")[0]
    assert float(row["generator.norm"]) > 0


def test_the_card_says_how_many_trained(pair):
    card = json.loads((pair / "whole" / "weights.json").read_text())
    assert card["processes"] == 2
