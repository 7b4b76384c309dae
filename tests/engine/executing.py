"""What tests of shards share: plug-ins, a plan that is worth cutting, and results as bytes."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil
from small_plans import asked, know_toys  # noqa: F401

from retarget_bench.evaluation import runner, shards
from retarget_bench.evaluation.plan import Plan
from tests.in_process import InThisProcess

METHODS = ("toy_method[does=noise]", "toy_method[does=nan]", "toy_batches", "copy_rotations")


def small_shards(patch: Any) -> None:
    """As many shards as there can be."""
    patch.setattr(shards, "SHARDS", 10_000)


def plan(root: Path, executor: str = "local", *methods: str, **changes: Any) -> Plan:
    """Methods of all kinds, one of them with two seeds."""
    return asked(root, *(methods or METHODS), executor=executor, **{"clips": 5, "seeds": 2, **changes})


def run(root: Path, executor: str = "local", *methods: str, **changes: Any) -> dict[str, bytes]:
    runner.run(plan(root, executor, *methods, **changes), lambda done, total: None)
    return files(root)


def files(root: Path) -> dict[str, bytes]:
    """Every file of results, predictions included, by its path; headers without their dates."""
    paths = {str(path.relative_to(root)): path for path in sorted(root.rglob("*")) if path.is_file()}
    return {name: _undated(path) for name, path in paths.items() if ".timing" not in name}


def _undated(path: Path) -> bytes:
    if path.suffix != ".json" or path.parent.parent.name == "intra":
        return path.read_bytes()
    facts = json.loads(path.read_text())
    facts.pop("date", None)
    return json.dumps(facts).encode()


def started(*names: str) -> list[psutil.Process]:
    """The living processes that this one started, directly or not, with one of the names in their line."""
    processes = []
    for each in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            line = " ".join(each.cmdline() or [each.name()])
            if each.is_running() and any(name in line for name in names):
                processes.append(each)
    return processes


class Shuffled:
    """An engine that carries out shards here, in any order and some of them twice."""

    submitted: Sequence[int] = ()

    def run(self, folder: Path, numbers: Sequence[int]) -> Iterator[tuple[int, str]]:
        Shuffled.submitted = list(numbers)
        order = [*numbers, *list(numbers)[::3]]
        random.Random(7).shuffle(order)
        finished = set(InThisProcess().run(folder, order))
        yield from sorted(finished)
