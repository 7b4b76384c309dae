"""Shards as tasks of Ray, also where workers and whole nodes die."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import executing
import pytest
from executing import run, started

from retarget_bench.errors import BenchError

ray = pytest.importorskip("ray", reason="needs the extra ray")
pytestmark = pytest.mark.slow
SLOW = ("slow_copy[seconds=0.3]",)
QUIET = {"include_dashboard": False, "log_to_driver": False, "logging_level": "ERROR"}


@pytest.fixture(autouse=True)
def _small(monkeypatch) -> Iterator[None]:
    executing.know_toys()
    executing.small_shards(monkeypatch)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    monkeypatch.setenv("RAY_worker_niceness", "0")
    monkeypatch.setenv("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    yield
    ray.shutdown()


@pytest.fixture(scope="module")
def local(tmp_path_factory) -> dict[str, bytes]:
    executing.know_toys()
    return run(tmp_path_factory.mktemp("local"), "local", *SLOW)


def once_running(root: Path, act: Callable[[], object]) -> threading.Thread:
    """Do something when a first part is there."""

    def wait() -> None:
        while not list(root.glob(".shards/*/parts/[0-9]*")):
            time.sleep(0.05)
        act()

    thread = threading.Thread(target=wait)
    thread.start()
    return thread


def test_tasks_give_the_same_bytes_and_nothing_stays(tmp_path):
    assert run(tmp_path / "ray", "ray") == run(tmp_path / "local")
    assert not ray.is_initialized()
    assert not started("raylet")


def test_a_worker_is_killed_and_ray_tries_again(tmp_path, local):
    ray.init(num_cpus=2, **QUIET)
    killed = once_running(tmp_path, lambda: started("ray::carry_out")[0].kill())
    assert run(tmp_path, "ray", *SLOW) == local
    killed.join()
    assert ray.is_initialized()  # it was here before


def test_the_only_node_is_lost_and_what_was_finished_is_kept(tmp_path, local):
    ray.init(num_cpus=1, **QUIET)
    killed = once_running(tmp_path, lambda: [each.kill() for each in started("raylet/raylet")])
    with pytest.raises(BenchError, match=r"shards were lost; .* What was finished is kept; run again"):
        run(tmp_path, "ray", *SLOW)
    killed.join()
    ray.shutdown()
    assert run(tmp_path, "ray", *SLOW) == local


def test_a_cluster_that_is_not_there_is_told(tmp_path):
    with pytest.raises(BenchError, match=r"Ray cannot be used \(127\.0\.0\.1:1\)"):
        run(tmp_path, 'ray[address="127.0.0.1:1"]')
