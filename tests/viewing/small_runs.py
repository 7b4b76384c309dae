"""Results of toy methods on toy motion, made in this very process: what tests of showing stand on."""

from __future__ import annotations

from pathlib import Path

from retarget_bench.motion import bvh
from retarget_bench.plugins import registry
from retarget_bench.results.store import ResultPaths
from tests.engine.small_plans import asked
from tests.in_process import run_here
from tests.viewing.viewing_toys.toy_moves import PERSON, body, moving

HERE = Path(__file__).parent
CASE = "toy_moves/small>tall/<b>nod</b>"
OTHER = "toy_moves/tall>small/<b>nod</b>"


def toys() -> None:
    """Make the toy data set and the toy method known."""
    registry.add_file(HERE.parent / "engine" / "toys" / "toy_method.py")
    registry.add_file(HERE / "viewing_toys" / "toy_moves.py")


def ran(root: Path, *does: str, data: str = "toy_moves") -> list[ResultPaths]:
    """Results of ``toy_method[does=...]`` on both cases, by the metric ``position``."""
    toys()
    return run_here(asked(root, *(f"toy_method[does={each}]" for each in does), data=data))


def bvh_file(path: Path, frames: int, fps: float = 30.0, joints: dict = PERSON) -> Path:
    """A BVH file of a toy body that nods and goes forward."""
    bvh.write(path, moving(body(path.stem, joints), frames, fps))
    return path
