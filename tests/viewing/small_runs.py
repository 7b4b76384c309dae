"""Results of toy methods on toy motion, made in this very process: what tests of showing stand on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from retarget_bench.evaluation import runner as run
from retarget_bench.evaluation.plan import Plan
from retarget_bench.evaluation.process_pool import Done
from retarget_bench.evaluation.worker import work
from retarget_bench.motion import bvh
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import ResultPaths
from tests.viewing.viewing_toys.toy_moves import PERSON, body, moving

HERE = Path(__file__).parent
CASE = "toy_moves/small>tall/<b>nod</b>"
OTHER = "toy_moves/tall>small/<b>nod</b>"


class InThisProcess:
    """An executor that starts no process; jobs that ask for anything but cases have none to do here."""

    def run(self, function: str, payloads: Sequence[Any]) -> Iterator[Done]:
        del function
        for number, job in enumerate(payloads):
            yield Done(number, work(job))


def toys() -> None:
    """Make the toy data set and the toy method known."""
    registry.add_file(HERE.parent / "engine" / "toys" / "toy_method.py")
    registry.add_file(HERE / "viewing_toys" / "toy_moves.py")


def ran(root: Path, *does: str, data: str = "toy_moves") -> list[ResultPaths]:
    """Results of ``toy_method[does=...]`` on both cases, by the metric ``position``."""
    toys()
    plan = Plan(
        methods=tuple(Spec.parse(f"toy_method[does={each}]") for each in does),
        datasets=(Spec.parse(data),),
        splits=("intra",),
        metrics=("position",),
        root=root,
    )
    return run.run(plan, lambda done, total: None, InThisProcess())


def bvh_file(path: Path, frames: int, fps: float = 30.0, joints: dict = PERSON) -> Path:
    """A BVH file of a toy body that nods and goes forward."""
    bvh.write(path, moving(body(path.stem, joints), frames, fps))
    return path
