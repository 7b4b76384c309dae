"""SIGKILL to any process of a run, at random moments: it goes on, and ends with the same bytes."""

import random
import threading
import time
from pathlib import Path

import psutil
import pytest
from small_plans import asked

from retarget_bench.evaluation import runner
from retarget_bench.plugins import registry

TOYS = Path(__file__).parent / "toys"
METHODS = ("copy_rotations", "toy_method", "toy_method[does=shaken]", "toy_method[does=noise]")


class Killer:
    """Kills a random process that this one has started, directly or not, now and then, until it is left."""

    def __init__(self, seed: int) -> None:
        self.kills = 0
        self._moments = random.Random(seed)
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._kill)

    def __enter__(self) -> "Killer":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join()

    def _kill(self) -> None:
        while not self._done.wait(self._moments.uniform(0.02, 0.4)):
            family = [p for p in psutil.Process().children(recursive=True) if _ours(p)]
            if family:
                try:
                    self._moments.choice(family).kill()
                    self.kills += 1
                except psutil.Error:
                    pass


def _ours(process: psutil.Process) -> bool:
    """A scoring process, a template or a prediction worker; not multiprocessing's own helper."""
    try:
        line = " ".join(process.cmdline())
    except psutil.Error:
        return False
    return "spawn_main" in line or "prediction.template" in line


@pytest.mark.slow
def test_any_process_may_be_killed_at_any_moment(tmp_path):
    kills = 50
    for name in ("toy_cases", "toy_method"):
        registry.add_file(TOYS / f"{name}.py")
    clips = 4 * kills
    runner.run(asked(tmp_path / "whole", *METHODS, clips=clips, jobs=2), lambda done, total: None)
    found, deadline = 0, time.monotonic() + 20 * kills
    for number in range(100):
        plan = asked(
            tmp_path / "killed", *METHODS, clips=clips, jobs=2, redo="always" if number else "missing"
        )
        with Killer(number) as killer:
            runner.run(plan, lambda done, total: None)
        found += killer.kills
        if found >= kills or time.monotonic() > deadline:
            break
    assert found >= kills
    runner.run(asked(tmp_path / "killed", *METHODS, clips=clips, redo="failed"), lambda done, total: None)
    for wanted in sorted((tmp_path / "whole").rglob("intra/*.[cn][sp][vz]")):
        made = tmp_path / "killed" / wanted.relative_to(tmp_path / "whole")
        assert made.read_bytes() == wanted.read_bytes(), wanted.name
