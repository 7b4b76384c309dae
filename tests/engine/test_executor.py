"""The local pool: every job is answered once, whatever it does to its process."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import jobs
import pytest

from retarget_bench.evaluation.process_pool import LocalPool

HERE = Path(__file__).parent


@pytest.fixture(autouse=True)
def _importable(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))


def test_every_job_is_answered_once():
    done = list(LocalPool(2).run(jobs.square, range(20)))
    assert sorted((each.job, each.result) for each in done) == [(n, n * n) for n in range(20)]


def test_no_jobs_start_no_process():
    assert list(LocalPool(4).run(jobs.square, [])) == []


def test_trouble_costs_its_own_job():
    what = ["fine", "raise", "kill", "exit", "fine", "threads"]
    done = {each.job: each for each in LocalPool(2).run(jobs.trouble, what)}
    assert sorted(done) == list(range(6))
    assert done[1].error == "ValueError: seven"
    assert "SIGKILL" in done[2].error
    assert "exit code 3" in done[3].error
    assert isinstance(done[0].result, int)
    assert isinstance(done[4].result, int)
    assert done[5].result == "1"


def test_torch_has_one_thread_in_a_worker(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    (done,) = LocalPool(1).run(jobs.trouble, ["torch"])
    assert done.result == (1, 400)


def test_the_parents_environment_is_left_alone(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    list(LocalPool(1).run(jobs.square, [1]))
    assert os.environ["OMP_NUM_THREADS"] == "7"


def test_workers_end_with_a_parent_that_is_killed():
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import jobs\n"
        "from retarget_bench.evaluation.process_pool import LocalPool\n"
        "if __name__ == '__main__':\n"
        "    for each in LocalPool(2).run(jobs.nap, [0.01, 0.01, 0.2, 0.2, 0.2, 0.2]):\n"
        "        print(each.result, flush=True)\n"
    )
    environment = os.environ | {"PYTHONPATH": f"{HERE.parents[1]}"}
    line = [sys.executable, "-c", code, str(HERE)]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True, env=environment) as process:
        workers = {int(process.stdout.readline()) for _ in range(2)}
        process.send_signal(signal.SIGKILL)
        process.wait()
    deadline = time.monotonic() + 20
    while any(Path(f"/proc/{pid}").exists() for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not [pid for pid in workers if Path(f"/proc/{pid}").exists()]
