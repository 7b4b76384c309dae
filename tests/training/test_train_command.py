"""The command line of ``bench train``: what is typed, and what is said."""

import json
import re

import pytest

from retarget_bench import cli
from retarget_bench.plugins import registry
from retarget_bench.training import run_folder, train
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.record import Run
from tests.training.conftest import TOYS

WALKS, TRAINEE = TOYS / "toy_walks.py", TOYS / "toy_trainee.py"


@pytest.fixture
def bench(toy_run, capsys, monkeypatch):
    """``bench train`` in this process, with no plug-ins of other tests: exit status, output, errors."""
    own = [(TOYS / f"{name}.py").resolve() for name in ("toy_walks", "toy_trainee")]
    monkeypatch.setattr(registry, "_FILES", {path: registry._FILES[path] for path in own})

    def run(*arguments):
        with pytest.raises(SystemExit) as ended:
            cli.main(["train", *arguments, "--device", "cpu"])
        return ended.value.code, *capsys.readouterr()

    return run


def test_it_says_every_validation_and_how_to_use_the_weights(bench, tmp_path):
    status, out, _ = bench("toy_trainee", "-d", "toy_walks", "--out", str(tmp_path / "a b"))
    assert status == 0
    amount, *lines = out.splitlines()
    assert re.fullmatch(r"training on \d+ minutes of motion: \d+ clips of \d+ characters", amount)
    pattern = (
        r"step (\d+), \d+ s: generator [\d.]+, critic [\d.]+; validation intra [\d.]+ / [\d.]+, cross .*"
    )
    assert [re.fullmatch(pattern, line)[1] for line in lines[:3]] == ["15", "30", "40"]
    assert lines[3].startswith("toy_trainee: 40 steps in ")
    method = f"{TRAINEE}[weights={tmp_path / 'a b'}]"
    assert lines[4] == f"Use them: bench run '{method}' -d '{WALKS}'"


def test_the_folder_is_named_after_the_method_with_its_parameters(bench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for method in ("toy_trainee", "toy_trainee[does=slowly]"):
        assert bench(method, "-d", "toy_walks", "--preset", "quick")[0] == 0
    names = sorted(path.name for path in (tmp_path / "runs" / "train").iterdir())
    assert names[0] == "toy_trainee"
    assert re.fullmatch(r"toy_trainee-[0-9a-f]{8}", names[1])


def test_without_a_method_it_asks_for_one(bench):
    status, _, err = bench("-d", "toy_walks")
    assert status == 2
    assert "say which METHOD to train, or --resume -o DIR" in err


def test_torchrun_is_told_the_sentence_too(bench, tmp_path, monkeypatch):
    """As torch reads and prints it, in its own report on processes that failed."""
    from torch.distributed.elastic.multiprocessing.errors import ChildFailedError, ProcessFailure

    monkeypatch.setenv("TORCHELASTIC_ERROR_FILE", str(tmp_path / "error.json"))
    status, _, err = bench("toy_trainee", "-d", "toy_walks", "--out", str(tmp_path), "--preset", "no")
    failure = ProcessFailure(0, 1, status, str(tmp_path / "error.json"))
    report = ChildFailedError("bench", {0: failure}).format_msg()
    assert f"traceback : {err.strip()}\n" in report
    assert failure.timestamp > 0


def test_ctrl_c_says_how_to_go_on(bench, tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(train, "train", interrupted)
    status, _, err = bench("toy_trainee[does=x]", "-d", "toy_walks", "--out", str(tmp_path))
    assert (status, "goes on" in err, "before the first checkpoint" in err) == (130, False, True)
    recipe = TrainingConfig(steps=9, batch=1, window=1, rate=1.0)
    begun = Run(method="toy_trainee", version="1", facts={}, recipe=recipe, dataset="toy_walks", steps=3)
    run_folder.write(tmp_path, begun)
    status, _, err = bench("toy_trainee[does=x]", "-d", "toy_walks", "--out", str(tmp_path))
    assert status == 130
    assert err.startswith(
        f"bench: interrupted. bench train '{TRAINEE}[does=x]' --resume -o {tmp_path} goes on"
    )


def test_going_on_says_from_where(bench, toy_run, tmp_path):
    toy_run(stop=20)
    status, out, _ = bench("--resume", "--out", str(tmp_path / "run"))
    assert status == 0
    assert out.splitlines()[0] == "continuing from step 15"
    _, out, _ = bench("--resume", "--out", str(tmp_path / "run"))
    assert out.splitlines()[0] == "the budget ended at step 40; with a longer --budget it goes on"


def test_a_method_that_is_called_like_a_metric_is_trained(bench, tmp_path):
    """``nkn`` is both. Of a metric its feature networks would be trained, whatever the preset."""
    assert {"nkn"} <= {each.name for each in registry.names("metrics")}
    status, _, err = bench("nkn", "-d", "puppets", "--preset", "no such", "--out", str(tmp_path / "run"))
    assert status == 2
    assert "nkn has no preset 'no such'" in err


def test_metrics_without_networks_cannot_be_trained(bench, tmp_path):
    status, _, err = bench("position", "-d", "puppets", "--out", str(tmp_path / "run"))
    assert status == 2
    assert "'position'" in err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("command", [["train", "nkn"], ["ablate", "smrm", "table2"]])
def test_a_seed_that_torch_does_not_take_is_refused(command, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main([*command, "-d", "puppets", "--seed", "99999999999999999999"])
    assert ended.value.code == 2
    assert "seed is 99999999999999999999; it must be at least 0" in " ".join(
        capsys.readouterr().err.split()
    )


def test_the_line_that_uses_the_weights_says_where_the_data_lie(bench, tmp_path):
    status, out, _ = bench(
        *("toy_trainee", "-d", "toy_walks", "--root", "/my data", "--preset", "quick"),
        *("--out", str(tmp_path / "run")),
    )
    assert status == 0
    assert out.splitlines()[-1].endswith(f" -d '{WALKS}' --root '/my data'")


def test_resume_without_a_run_says_so_before_it_asks_for_data(bench, tmp_path):
    status, _, err = bench("toy_trainee", "--resume", "--out", str(tmp_path / "run"))
    assert status == 2
    assert err == f"bench: {tmp_path / 'run'} holds no run to go on with; with -d DATASET one begins\n"


def test_several_data_sets_are_trained_on_and_the_first_that_tests_is_named(bench, tmp_path):
    out = tmp_path / "run"
    data = (
        "-d",
        "toy_walks[kind=near]",
        "-d",
        "toy_walks[root=/a b]",
        "--preset",
        "quick",
        "--out",
        str(out),
    )
    status, output, _ = bench("toy_trainee", *data)
    assert (status, output.splitlines()[-1]) == (
        0,
        f"Use them: bench run '{TRAINEE}[weights={out}]' -d '{WALKS}[kind=near]'",
    )
    recorded = json.loads((out / "run.json").read_text())
    assert recorded["dataset"] == "toy_walks[kind=near]+toy_walks[root=/a b]"
    assert recorded["command"].startswith(
        "bench train toy_trainee.py -d 'toy_walks.py[kind=near]' -d toy_walks.py --preset"
    )


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("toy_trainee", "-d", "toy_walks", "-d", "toy_walks"), "toy_walks is given twice"),
        (
            ("toy_trainee", "-d", "toy_walks", "-d", "puppets", "--root", "/a"),
            r"with several, each says where it lies: -d 'NAME\[root=DIR\]'",
        ),
        (("--resume", "--root", "/a"), "--root says where a data set lies; say by -d which one"),
        (
            ("toy_trainee", "-d", "toy_walks", "-d", r"toy_walks[kind=empty]"),
            "toy_walks has no training motion; see",
        ),
    ],
)
def test_what_data_cannot_be_asked_for(bench, tmp_path, words, says):
    status, _, err = bench(*words, "--out", str(tmp_path / "run"))
    assert status == 2
    assert re.search(says, " ".join(err.split()))
    assert "Traceback" not in err
