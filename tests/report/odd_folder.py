"""Folders of BVH files that are hard to show, and results on them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from retarget_bench.motion import bvh
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import ResultPaths
from tests.engine.small_plans import asked
from tests.in_process import run_here
from tests.viewing.viewing_toys.toy_moves import DOG, PERSON, body, moving

HERE = Path(__file__).parent


def _finger(side: str, finger: int) -> dict:
    """Seven joints in a row, on a hand."""
    across = 0.012 if side == "Left" else -0.012
    names = [f"{side}Hand", *(f"{side}Finger{finger}_{joint}" for joint in range(7))]
    places = [(across, 0, 0.008 * (finger - 6)), *[(across, 0, 0)] * 6]
    return {name: (parent, place) for parent, name, place in zip(names, names[1:], places, strict=False)}


FINGERS = [_finger(side, finger) for side in ("Left", "Right") for finger in range(13)]
MANY = PERSON | {name: joint for finger in FINGERS for name, joint in finger.items()}
"""200 joints: a person with thirteen fingers of seven joints on each hand."""
BODIES = {"person": PERSON, "many": MANY, "dog": DOG}
CLIPS = {"nod": 20, "still": 1}
"""Clip -> frames."""


def write(root: Path, bodies: Mapping[str, dict], clips: Mapping[str, int]) -> None:
    """A folder per body (joints as in ``toy_moves``), in it a file per clip."""
    for number, (name, joints) in enumerate(bodies.items()):
        (root / name).mkdir(parents=True)
        for clip, frames in clips.items():
            person = body("body", joints, 1 + 0.1 * number)
            bvh.write(root / name / f"{clip}.bvh", moving(person, frames))


def ran(folder: Path, root: Path, methods: Iterable[str], splits: tuple[str, ...]) -> list[ResultPaths]:
    """Results of methods on such a folder."""
    registry.add_file(HERE / "report_toys" / "odd_answers.py")
    data = str(Spec("folder", {"root": str(folder)}))
    metrics = ("position", "slide", "smoothness")
    return run_here(asked(root, *methods, data=data, splits=splits, metrics=metrics))
