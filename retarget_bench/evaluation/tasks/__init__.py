"""Tasks that the engine derives from any data set's cases: reconstruct, denoise, joint-completion,
points.

The first three ask for a clean motion back: after it went through a method (HuMoT, Table 2), from positions
with noise on them (Figure 8), from positions of some of its joints (Figure 9). The last one retargets from
points on the source's surface. A data set knows nothing of them.
"""

from retarget_bench.api import PAIRED, TASKS, Dataset
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.tasks.definitions import QUESTIONS
from retarget_bench.plugins.spec import Spec

RETARGET, POINTS = PAIRED
DERIVED = tuple(task for task in TASKS if task not in PAIRED)
"""Tasks of one body each, by level."""


def derive(data: Dataset, task: Spec) -> Dataset:
    """The cases of a derived task, which is canonical. Raises BenchError for an unknown one."""
    from retarget_bench.evaluation.tasks.derived import Derived
    from retarget_bench.evaluation.tasks.points import PointsTask

    return PointsTask(data) if canonical(task).name == POINTS else Derived(data, task)


def canonical(task: Spec) -> Spec:
    """A task with those of its parameters that are not the usual ones.

    levels: with commas between them. motions: at most so many, evenly spread over structures and clips.
    Raises BenchError for an unknown task, parameter or level.
    """
    if task.name not in (*PAIRED, *QUESTIONS):
        tasks = ", ".join((*PAIRED, *QUESTIONS))
        raise BenchError(f"there is no task {task.name!r}; tasks are {tasks}")
    question = QUESTIONS.get(task.name)
    of_levels = ("levels",) if question and question.LEVELS else ()
    parameters = (*of_levels, "motions") if question else ()
    if unknown := sorted(set(task.parameters) - set(parameters)):
        offered = f"it has {' and '.join(parameters)}" if parameters else "it has none"
        raise BenchError(f"{task.name} has no parameter {unknown[0]!r}; {offered}")
    changed = dict(task.parameters)
    if question is not None and "levels" in changed:
        changed["levels"] = ",".join(level.word for level in question(str(changed["levels"])).levels)
        if changed["levels"] == question.LEVELS:
            del changed["levels"]
    motions = changed.get("motions", 1)
    if not isinstance(motions, int) or isinstance(motions, bool) or motions < 1:
        raise BenchError(f"{task.name}: motions is {motions!r}; it is a number of motions, at least 1")
    return Spec(task.name, changed)
