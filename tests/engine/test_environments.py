"""Methods in other Python environments, programs, and workers that have numpy alone."""

from __future__ import annotations

import ast
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import psutil
import pytest
from in_process import InThisProcess
from small_plans import asked

from retarget_bench.analysis import summary
from retarget_bench.api import Context
from retarget_bench.cli import main
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import plan, runner
from retarget_bench.evaluation.prediction import numpy_worker
from retarget_bench.evaluation.prediction.limits import Limits
from retarget_bench.evaluation.prediction.workers import WorkerPool
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.tables import builder

pytestmark = pytest.mark.usefixtures("toys")

LOOP = Path(numpy_worker.__file__)
CODE = """
import os, sys, time
import numpy as np

DOES = "copy", "refuse", "raise", "crash", "hang", "short", "copy"

def retarget(source, target, context):
    does = DOES[context["seed"] % len(DOES)]
    print("asked to", does)
    if does == "refuse":
        raise NotImplementedError("too tall")
    if does == "raise":
        raise ValueError("no idea")
    if does == "crash":
        os._exit(5)
    if does == "hang":
        time.sleep(60)
    if does == "short":
        return {"positions": np.zeros((2, len(target["names"]), 3))}
    assert source["body"]["names"] == target["names"]
    assert target["offsets"].shape == (len(target["names"]), 3)
    assert source["fps"] > 0 and context["parameters"] in ({}, {"on": "1.5"})
    return {"rotations": source["rotations"], "root": source["root"]}
"""
PROGRAM = """
import json, sys
from pathlib import Path
import numpy as np

*does, folder = sys.argv[1:]
if does:
    sys.exit("first\\nthere is no answer\\n")
for case in json.loads((Path(folder) / "manifest.json").read_text())["cases"]:
    assert (Path(folder) / (case["target_file"] + ".bvh")).exists()
    with np.load(Path(folder) / (case["source_file"] + ".npz")) as file:
        np.savez(Path(folder) / case["prediction"], rotations=file["rotations"], root=file["root"])
"""


@pytest.fixture
def ask(tmp_path):
    """Outcomes of a method's process; no scoring."""
    pools = []

    def asking(method: str, seeds: Sequence[int] = (0,), *, together: bool = False, **limits: float):
        data = bound.dataset(Spec.parse("toy_cases[clips=9]")).built
        infos = data.cases("retarget", "intra")
        questions = [
            (data.load(info), Context(seed=seed)) for info, seed in zip(infos, seeds, strict=False)
        ]
        pools.append(
            WorkerPool(tmp_path / f"pool-{len(pools)}", tmp_path, registry.files(), Limits(**limits))
        )
        worker = pools[-1].worker(plan.placed(method).spec)
        worker.log = tmp_path / "log.txt"
        return worker.ask(questions) if together else [worker.ask([each])[0] for each in questions]

    yield asking
    for pool in pools:
        pool.close()


@pytest.fixture
def other(tmp_path):
    """This Python with another package on its path: a command."""
    installed = tmp_path / "site" / "extra-1.0.dist-info"
    installed.mkdir(parents=True)
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: extra\nVersion: 1.0\n")
    return f"env PYTHONPATH={shlex.quote(str(installed.parent))} {shlex.quote(sys.executable)}"


def _worker(tmp_path: Path, code: str = CODE) -> str:
    (tmp_path / "old_code.py").write_text(code)
    return shlex.join([sys.executable, str(LOOP), str(tmp_path / "old_code.py")])


def _arrays(outcome):
    return {name: getattr(outcome.prediction, name) for name in outcome.prediction.arrays}


# ------------------------------------------------------------------------------------------- this package
def test_results_of_another_environment_are_their_own_and_the_same_numbers(tmp_path, monkeypatch, other):
    monkeypatch.setattr(runner, "Local", InThisProcess)
    methods = [f'{name}@"{other}"' for name in ("copy_rotations", "toy_method[does=noise]")]
    request = asked(tmp_path, "copy_rotations", "toy_method[does=noise]", *methods, clips=1)
    places = runner.run(request, lambda done, total: None)
    here, noise, there, noise_there = (store.read_results(place) for place in places)
    assert here.paths.rows.read_bytes() == there.paths.rows.read_bytes()
    assert noise.paths.rows.read_bytes() == noise_there.paths.rows.read_bytes()
    for entry in here.entries:
        first, second = (np.load(each.paths.prediction(entry.case)) for each in (here, there))
        assert all(first[name].tobytes() == second[name].tobytes() for name in ("rotations", "root"))
    facts = there.header.method.environment
    label = f"copy_rotations@python{sys.version_info[0]}.{sys.version_info[1]}-{facts['lock'][:8]}"
    assert there.header.method.label == label
    assert facts["packages"]["numpy"] == np.__version__
    assert facts["lock"] != numpy_worker.environment()["lock"]
    assert not here.header.method.environment
    assert here.header.keys != there.header.keys
    assert runner.run(asked(tmp_path, "copy_rotations", methods[0], clips=1), _never)
    (table,) = builder.tables(summary.split_summaries([there.paths]), ["mpjpe_h.world"])
    (origin,) = table.provenance
    assert f"(lock {facts['lock']}): {facts['python']}, numpy {np.__version__}" in origin.versions
    assert "copy_rotations@PYTHON" in origin.command


def _never(done: int, total: int) -> None:
    assert not total


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("/no/such/python", "No such file"),
        ("sh -c 'echo first >&2; echo the last >&2; exit 3'", "the last"),
        ("sh -c 'echo hello'", "hello"),
        ("sh -c 'exit 3'", "it has ended"),
        ("sh -c 'echo {}'", "does not tell its environment"),
        (f"{sys.executable} -S", "No module named 'numpy'"),
        ("'open", "is no command"),
    ],
)
def test_what_cannot_be_started_is_a_sentence(tmp_path, command, message):
    with pytest.raises(BenchError) as raised:
        runner.run(
            asked(tmp_path, str(Spec("copy_rotations", environment=command))), lambda done, total: None
        )
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_an_environment_that_changes_during_a_run_answers_no_more(tmp_path, other):
    data = bound.dataset(Spec.parse("toy_cases")).built
    pool = WorkerPool(tmp_path / "workers", tmp_path, registry.files(), Limits())
    worker = pool.worker(Spec("toy_method", environment=other))
    worker.lock = "another"
    (outcome,) = worker.ask([(data.load(data.cases("retarget", "intra")[0]), Context())])
    pool.close()
    assert outcome.status == "failed"
    assert "not the environment that the run began with" in outcome.message


def test_parameters_are_checked_on_this_side(tmp_path):
    with pytest.raises(BenchError, match="no parameter 'rule'"):
        plan.evaluation_units(asked(tmp_path, "copy_rotations[rule=1]@/no/such/python"))


def test_methods_that_are_asked_here_have_no_environment():
    with pytest.raises(BenchError, match="bench run"):
        registry.create("methods", "copy_rotations@/usr/bin/python3")
    with pytest.raises(BenchError, match="an environment is for methods"):
        registry.canonical("metrics", "position@/usr/bin/python3")


def test_a_worker_behind_another_program_lives_and_ends_with_it(tmp_path):
    """As with ``conda run``: the Python is a child of what was started."""
    shim = tmp_path / "run"
    shim.write_text(f'#!/bin/sh\n"{sys.executable}" "$@"\nexit $?\n')
    shim.chmod(0o755)
    data = bound.dataset(Spec.parse("toy_cases")).built
    questions = [(data.load(data.cases("retarget", "intra")[0]), Context())]
    pool = WorkerPool(tmp_path / "workers", tmp_path, registry.files(), Limits())
    try:
        good, dying = (
            pool.worker(Spec("toy_method", parameters, environment=str(shim)))
            for parameters in ({}, {"does": "die"})
        )
        assert good.ask(questions)[0].status == "ok"
        processes = [psutil.Process(good.pid), *psutil.Process(good.pid).children(recursive=True)]
        assert dying.ask(questions)[0].status == "failed"
        assert good.ask(questions)[0].status == "ok"
        assert good.pid == processes[0].pid
    finally:
        pool.close()
    assert len(processes) == 2
    assert not psutil.wait_procs(processes, timeout=5)[1]


def _list(outcome):
    return list(_arrays(outcome).values())


# ------------------------------------------------------------------------------------------- numpy alone
STATUSES = (
    ("ok", ""),
    ("unsupported", "too tall"),
    ("failed", "ValueError: no idea (old_code.py:13)"),
    ("failed", "exit code 5"),
    ("failed", "no answer within 1 s"),
    ("invalid", "frames"),
    ("ok", ""),
)


def test_plain_code_has_the_statuses_of_any_method(ask, tmp_path):
    """One after the other: it is started again after it has crashed or was too slow."""
    seeds = range(len(STATUSES))
    spec = Spec("toy_method", {"on": "1.5"}, environment=_worker(tmp_path))
    for outcome, (status, message) in zip(ask(str(spec), seeds, timeout=1.0), STATUSES, strict=True):
        assert outcome.status == status, outcome
        assert message in outcome.message
    log = (tmp_path / "log.txt").read_text()
    assert [f"asked to {does}" in log for does in ("copy", "hang", "short")] == [True] * 3


def test_the_worker_file_is_plain_enough():
    text = LOOP.read_text()
    ast.parse(text, feature_version=(3, 7))
    imported = {name.split(".")[0] for name in _imports(ast.parse(text))}
    assert imported - sys.stdlib_module_names == {"numpy"}


def _imports(tree: ast.Module):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module


def test_a_changed_worker_makes_results_outdated(tmp_path):
    spec = Spec("toy_method", environment=_worker(tmp_path))
    (unit,) = plan.evaluation_units(asked(tmp_path, str(spec)))
    before = unit.keys
    _worker(tmp_path, CODE + "# other\n")
    (again,) = plan.evaluation_units(asked(tmp_path, str(spec)))
    assert before != again.keys
    assert unit.paths == again.paths
    with pytest.raises(BenchError, match="post-processors work where"):
        plan.evaluation_units(asked(tmp_path, f"{spec}+smooth"))


def test_new_worker_runs_as_it_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        main(["new", "method", "wobble", "--worker"])
    assert not stop.value.code
    registry.add_file(tmp_path / "wobble.py")
    monkeypatch.setattr(runner, "Local", InThisProcess)
    (place,) = runner.run(asked(tmp_path, "wobble", clips=1), lambda done, total: None)
    results = store.read_results(place)
    assert {each.status for each in results.entries} == {"ok"}
    assert results.header.method.label.startswith("wobble@python")


# --------------------------------------------------------------------------------------------- a program
def test_a_program_answers_several_questions(ask, tmp_path):
    (tmp_path / "answer.py").write_text(PROGRAM)
    command = f"{sys.executable} {tmp_path / 'answer.py'}"
    answers = map(_list, ask(str(Spec("external", {"command": command})), range(3), together=True))
    for (rotations, root), (expected, path) in zip(
        answers, map(_list, ask("toy_method", range(3))), strict=True
    ):
        assert np.allclose(rotations, expected, atol=1e-6)
        assert np.allclose(root, path, atol=1e-6)
    (outcome,) = ask(str(Spec("external", {"command": f"{command} fail"})))
    assert outcome.status == "failed"
    assert "exit code 1: there is no answer" in outcome.message


def test_a_program_is_known_by_its_files_or_its_version(tmp_path):
    program = tmp_path / "answer.sh"
    keys = []
    for text in ("one", "two", "one"):
        program.write_text(text)
        plan.forget()
        (unit,) = plan.evaluation_units(asked(tmp_path, f"external[command={program}]"))
        keys.append(unit.keys["prediction_key"])
    assert keys[0] == keys[2] != keys[1]
    with pytest.raises(BenchError, match="set version"):
        registry.create("methods", "external[command=ls]")
    registry.create("methods", "external[command=ls,version=3]")


@pytest.mark.parametrize(
    ("program", "message"),
    [("exit 0", "the program wrote no answer"), ("echo x > $1/0.npz", "not a readable .npz file")],
)
def test_a_program_without_an_answer_fails_its_case(ask, tmp_path, program, message):
    script = tmp_path / "program.sh"
    script.write_text(program)
    (outcome,) = ask(f"external[command=sh {script}]")
    assert outcome.status == "failed"
    assert message in outcome.message
    assert str(tmp_path) not in outcome.message
