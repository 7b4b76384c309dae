"""Errors by joint, on a body."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from retarget_bench.analysis.breakdown import UNKNOWN, breakdown, structures_of
from retarget_bench.errors import BenchError
from retarget_bench.figures import axis_limits
from retarget_bench.figures.data import values
from retarget_bench.figures.data.model import Axis, Figure, Mark, NothingToDraw, SkeletonChart
from retarget_bench.figures.data.values import Styles
from retarget_bench.motion import kinematics
from retarget_bench.motion.character import Character
from retarget_bench.results.result_matrix import ResultMatrix

MOST = 3
"""Structures that are drawn, those of most cases."""
SHARE = 0.97
"""The share of all joints that the colours are spread over."""
NOTHING = 0.01
"""% of the height: smaller errors are rounding, and have the colour of no error."""
Marks = dict[str, tuple[Mark, ...]]
"""Label -> the marks of a method's joints."""


def skeletons(matrix: ResultMatrix, value: str, bodies: Mapping[str, Character], styles: Styles) -> Figure:
    """A skeleton per method that is shown without being asked for, its joints sized and coloured by their
    errors, on one scale; of the structures of most cases.

    bodies: name -> character, of the data set; the first target of a structure is drawn. Raises
    NothingToDraw where no method has the value, and where the data set has no such body.
    """
    what = values.value_of([matrix], value, "joint")
    (ordered,) = values.in_order([matrix], styles)
    kept = values.shown((row.label for row in ordered.rows), styles)
    structures = _structures(ordered, bodies)
    drawn = []
    for structure, _ in Counter(structures.values()).most_common(MOST):
        of_structure = [info.target for info in ordered.cases if structures[info.id] == structure]
        body = next((bodies[name] for name in sorted(of_structure) if name in bodies), None)
        here = np.array([structures[info.id] == structure for info in ordered.cases])
        if body is not None and (marks := _marks(ordered, value, here, body)):
            drawn.append((structure, body, {label: marks[label] for label in kept if label in marks}))
    if not drawn:
        raise NothingToDraw(f"no method has {value} on bodies of this data set; bench table says why")
    numbers: dict[str, list[float]] = {}
    for _, _, marks in drawn:
        for label, each in marks.items():
            numbers.setdefault(label, []).extend(mark.mean.value for mark in each)
    errors = Axis(what.axis, 0.0, max(axis_limits.colour_end(numbers, SHARE), NOTHING))
    charts = tuple(
        SkeletonChart(
            matrix.split, label, body.name, _flat(body),
            tuple((p, joint) for joint, p in enumerate(body.skeleton.parents.tolist()) if p >= 0),
            errors, each, structure,
        )
        for structure, body, marks in drawn
        for label, each in marks.items()
    )  # fmt: skip
    return Figure("joints", matrix.dataset, f"{matrix.split}: by joint", skeletons=charts)


def _marks(matrix: ResultMatrix, value: str, here: np.ndarray, body: Character) -> Marks:
    """The marks of each method that has any, smallest error first. here: ``(cases,)`` bool: those that
    count."""
    places = {name: float(joint) for joint, name in enumerate(body.skeleton.names)}
    marks: dict[str, list[Mark]] = {}
    for part in breakdown(replace(matrix, values={value: matrix.values[value]}), "joint"):
        if part.part not in places:
            continue
        numbers = values.numbers_at(part, value)
        what = f"error of {part.part}, {part.values[value].unit}"
        for label, mean in values.means(part.restricted(here, part.part), value).items():
            cases = values.worst(part, value, np.where(here, numbers(label, ""), np.nan), what)
            mark = Mark(places[part.part], mean, replace(cases, value=""), part.part)
            marks.setdefault(label, []).append(mark)
    return {label: tuple(sorted(each, key=lambda mark: mark.mean.value)) for label, each in marks.items()}


def _structures(matrix: ResultMatrix, bodies: Mapping[str, Character]) -> dict[str, str]:
    """Case -> the structure of its target: as results say, else as the bodies are."""
    try:
        return structures_of(matrix)
    except BenchError:
        return {
            info.id: bodies[info.target].structure if info.target in bodies else UNKNOWN
            for info in matrix.cases
        }


def _flat(body: Character) -> tuple[tuple[float, float], ...]:
    """Joints right and up in metres, in the common reference pose: people from the front, so that their
    left is at the right; four-legged bodies from their left."""
    pose = kinematics.forward(body.skeleton, body.reference_pose[None], np.zeros((1, 3)))[0][0]
    across = -pose[:, 2] if body.four_legged else pose[:, 0]
    return tuple((float(x), float(y)) for x, y in zip(across, pose[:, 1], strict=True))
