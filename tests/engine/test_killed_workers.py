"""SIGKILL to any process of a run, at random moments: it goes on, and ends with the same bytes."""

import time
from contextlib import suppress
from pathlib import Path

import pytest
from executing import Killer
from small_plans import asked

from retarget_bench.errors import BenchError
from retarget_bench.evaluation import runner
from retarget_bench.plugins import registry

TOYS = Path(__file__).parent / "toys"
METHODS = ("copy_rotations", "toy_method", "toy_method[does=shaken]", "toy_method[does=noise]")
OWN_PROCESSES = ("shard_process", "prediction.fork_server")
"""In the lines of scoring processes, of those that workers are forked from, and of all forked ones."""


@pytest.mark.slow
def test_any_process_may_be_killed_at_any_moment(tmp_path):
    kills = 50
    for name in ("toy_cases", "toy_method"):
        registry.add_file(TOYS / f"{name}.py")
    clips = 4 * kills
    runner.run(asked(tmp_path / "whole", *METHODS, clips=clips, jobs=2), lambda done, total: None)
    killed, deadline = 0, time.monotonic() + 20 * kills
    for number in range(100):
        plan = asked(
            tmp_path / "killed", *METHODS, clips=clips, jobs=2, overwrite="always" if number else "missing"
        )
        # a shard whose processes are killed twice while they start is lost, and kept is what was finished
        with Killer(number, *OWN_PROCESSES) as killer, suppress(BenchError):
            runner.run(plan, lambda done, total: None)
        killed += killer.kills
        if killed >= kills or time.monotonic() > deadline:
            break
    assert killed >= kills
    runner.run(
        asked(tmp_path / "killed", *METHODS, clips=clips, overwrite="failed"), lambda done, total: None
    )
    for expected in sorted((tmp_path / "whole").rglob("intra/*.[cn][sp][vz]")):
        actual = tmp_path / "killed" / expected.relative_to(tmp_path / "whole")
        assert actual.read_bytes() == expected.read_bytes(), expected.name
