"""Tasks that the engine derives from any data set's cases: reconstruct, denoise, upsample, points.

The first three ask for a clean motion back: after it went through a method (HuMoT, Table 2), from positions
with noise on them (Figure 8), from positions of some of its joints (Figure 9). The last one retargets from
points on the source's surface. A data set knows nothing of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from retarget_bench.api import PAIRED, TASKS, Dataset
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.tasks.definitions import QUESTIONS, TaskQuestion
from retarget_bench.plugins.spec import Spec

if TYPE_CHECKING:
    from retarget_bench.evaluation.tasks.derived import Derived
    from retarget_bench.evaluation.tasks.points import PointsTask

RETARGET, POINTS = PAIRED
DERIVED = tuple(task for task in TASKS if task not in PAIRED)
"""Tasks of one body each, by level."""


def derive(data: Dataset, task: Spec) -> Derived | PointsTask:
    """The cases of a derived task. Raises BenchError for an unknown task or parameter, or a bad level."""
    from retarget_bench.evaluation.tasks.derived import Derived
    from retarget_bench.evaluation.tasks.points import PointsTask

    if task.name == POINTS:
        if task.parameters:
            raise BenchError(f"{task.name} has no parameters; leave {next(iter(task.parameters))!r} out")
        return PointsTask(data)
    known = {"motions", *(("levels",) if _question(task.name).LEVELS else ())}
    if unknown := sorted(set(task.parameters) - known):
        raise BenchError(f"{task.name} has no parameter {unknown[0]!r}; it has {', '.join(sorted(known))}")
    return Derived(data, task)


def _question(name: str) -> type[TaskQuestion]:
    if name not in QUESTIONS:
        raise BenchError(f"there is no task {name!r}; tasks are {', '.join((*QUESTIONS, POINTS))}")
    return QUESTIONS[name]


def canonical(name: str, levels: str | None = None, motions: int = 0) -> Spec:
    """A task with those parameters that are not the usual ones. Raises BenchError for a bad level.

    levels:  with commas between them; None: the usual ones.
    motions: at most so many, evenly spread over structures and clips; 0: all.
    """
    asked, changed = _question(name), dict[str, str | int]()
    if levels is not None:
        if not asked.LEVELS:
            raise BenchError(f"{name} has no levels; leave them out")
        words = ",".join(level.word for level in asked(levels).levels)
        if words != asked.LEVELS:
            changed["levels"] = words
    if motions:
        changed["motions"] = motions
    return Spec(name, changed)
