"""Functions in processes of this machine: every payload is answered once, whatever it does to them."""

import os
import signal
import subprocess
import sys
import time
from multiprocessing import active_children
from pathlib import Path

import pytest

from retarget_bench.parallel import DIED, carried_out
from tests import parallel_jobs as jobs

ROOT = Path(__file__).parents[1]


def test_every_payload_is_answered_once():
    answers = list(carried_out(jobs.square, range(20), 2))
    assert sorted((each.number, each.result) for each in answers) == [(n, n * n) for n in range(20)]


def test_what_is_given_up_ends():
    begun = time.monotonic()
    run = carried_out(jobs.nap, [0.0, 60.0], 1)
    next(run)
    with pytest.raises(KeyboardInterrupt):
        run.throw(KeyboardInterrupt())
    assert time.monotonic() - begun < 30
    assert not active_children()


def test_trouble_costs_its_own_payload():
    what = ["fine", "raise", "kill", "exit", "fine", "threads"]
    answers = {each.number: each for each in carried_out(jobs.trouble, what, 2)}
    assert sorted(answers) == list(range(6))
    assert answers[1].error == "ValueError: seven"
    assert answers[2].error == answers[3].error == DIED
    assert isinstance(answers[0].result, int)
    assert isinstance(answers[4].result, int)
    assert answers[5].result == "1"


def test_torch_has_one_thread_in_a_process(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    (answer,) = carried_out(jobs.trouble, ["torch"], 1)
    assert answer.result == (1, 400)
    assert os.environ["OMP_NUM_THREADS"] == "7"


def test_processes_end_with_a_parent_that_is_killed():
    code = (
        "from retarget_bench.parallel import carried_out\n"
        "from tests import parallel_jobs as jobs\n"
        "for each in carried_out(jobs.nap, [0.01, 0.01, 0.2, 0.2, 60.0, 60.0], 2):\n"
        "    print(each.result, flush=True)\n"
    )
    line = [sys.executable, "-c", code]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True, env=environment) as process:
        workers = {int(process.stdout.readline()) for _ in range(4)}
        process.send_signal(signal.SIGKILL)
        process.wait()
    deadline = time.monotonic() + 20
    while any(Path(f"/proc/{pid}").exists() for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not [pid for pid in workers if Path(f"/proc/{pid}").exists()]
