"""The local pool: every job is answered once, whatever it does to its process."""

import os
import signal
import subprocess
import sys
import time
from multiprocessing import active_children
from pathlib import Path

import jobs
import pytest

from retarget_bench.evaluation.process_pool import LocalPool

HERE = Path(__file__).parent


@pytest.fixture(autouse=True)
def _importable(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))


def test_every_job_is_answered_once():
    with LocalPool(2) as pool:
        done = list(pool.run(jobs.square, range(20)))
    assert sorted((each.job, each.result) for each in done) == [(n, n * n) for n in range(20)]


def test_no_jobs_start_no_process():
    with LocalPool(4) as pool:
        assert list(pool.run(jobs.square, [])) == []
        assert not active_children()


def test_runs_share_processes_and_one_may_ask_for_fewer():
    with LocalPool(2) as pool:
        first = {each.result for each in pool.run(jobs.nap, [0.2, 0.2])}
        again = {each.result for each in pool.run(jobs.nap, [0.0] * 3, workers=1)}
    assert len(first) == 2
    assert len(again) == 1
    assert again <= first
    assert not active_children()


def test_a_run_that_is_given_up_leaves_no_job_to_the_next():
    with LocalPool(1) as pool:
        for _ in pool.run(jobs.nap, [0.0, 60.0]):
            break
        assert [each.result for each in pool.run(jobs.square, [3])] == [9]


def test_a_run_may_end_after_its_pool():
    with LocalPool(1) as pool:
        run = pool.run(jobs.nap, [0.0, 60.0])
        next(run)
    run.close()
    assert not active_children()


def test_trouble_costs_its_own_job():
    what = ["fine", "raise", "kill", "exit", "fine", "threads"]
    with LocalPool(2) as pool:
        done = {each.job: each for each in pool.run(jobs.trouble, what)}
    assert sorted(done) == list(range(6))
    assert done[1].error == "ValueError: seven"
    assert "SIGKILL" in done[2].error
    assert "exit code 3" in done[3].error
    assert isinstance(done[0].result, int)
    assert isinstance(done[4].result, int)
    assert done[5].result == "1"


def test_torch_has_one_thread_in_a_worker(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    with LocalPool(1) as pool:
        (done,) = pool.run(jobs.trouble, ["torch"])
    assert done.result == (1, 400)


def test_the_parents_environment_is_left_alone(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    with LocalPool(1) as pool:
        list(pool.run(jobs.square, [1]))
    assert os.environ["OMP_NUM_THREADS"] == "7"


def test_workers_end_with_a_parent_that_is_killed():
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import jobs\n"
        "from retarget_bench.evaluation.process_pool import LocalPool\n"
        "if __name__ == '__main__':\n"
        "    with LocalPool(2) as pool:\n"
        "        for each in pool.run(jobs.nap, [0.01, 0.01, 0.2, 0.2, 0.2, 0.2]):\n"
        "            print(each.result, flush=True)\n"
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
