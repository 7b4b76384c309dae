"""Errors by source and target, and by joint."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from retarget_bench.analysis.breakdown import UNKNOWN, breakdown, structures_of
from retarget_bench.analysis.summary import Mean
from retarget_bench.errors import BenchError
from retarget_bench.figures import axis_limits
from retarget_bench.figures.data import values
from retarget_bench.figures.data.model import (
    ColourScale,
    Figure,
    HeatMap,
    Mark,
    NothingToDraw,
    SkeletonChart,
)  # fmt: skip
from retarget_bench.motion import kinematics
from retarget_bench.motion.character import Character
from retarget_bench.results import case_metadata
from retarget_bench.results.result_matrix import ResultMatrix

MOST = 14
"""Bodies on a side of a map; where there are more, they are taken together by structure."""
BEHIND = 30
"""Cases that are kept behind a square."""
PAIRS, JOINTS = 0.98, 0.97
"""The shares of all squares, and of all joints, that the colours are spread over."""
NOTHING = 0.01
"""% of the height: smaller errors are rounding, and have the colour of no error."""


# ------------------------------------------------------------------------------------------------- pairs
def pairs(matrices: Sequence[ResultMatrix], value: str, order: Sequence[str] = ()) -> Figure:
    """A map per method of the mean of every pair, all splits in one, one colour scale for all.

    Bodies are taken together by structure where there are more than ``MOST``; where two splits then have
    the same pair, the later one counts (of two bodies rather than of one). Raises NothingToDraw where no
    result has the value.
    """
    what = values.value_of(matrices, value)
    ordered = values.in_order([each for each in matrices if value in each.values], order)
    headers, names = values.methods(ordered), _names(ordered)
    squares: dict[str, dict[tuple[str, str], Mark]] = {label: {} for label in headers}
    for matrix in ordered:
        numbers = values.numbers_at(matrix, value)
        pair_of = [(names[info.source], names[info.target]) for info in matrix.cases]
        for pair in sorted({each for each, own in zip(pair_of, matrix.own, strict=True) if own}):
            here = np.array([each == pair for each in pair_of]) & matrix.own
            name = " to ".join(pair)
            for label, mean in values.means(matrix.narrowed(value).restricted(here, name), value).items():
                shown = np.where(here, numbers(label, ""), np.nan)
                cases = values.worst(matrix, value, shown, f"{what.declared.label}, {name}", BEHIND)
                squares[label][pair] = Mark(label, 0.0, mean, cases, name)
    means = {label: [mark.mean.value for mark in each.values()] for label, each in squares.items()}
    least = min((number for each in means.values() for number in each), default=0.0)
    end = axis_limits.colour_end(means, values.ranked(ordered), PAIRS)
    scale = ColourScale(what.axis, min(0.0, least), end)
    sources, targets = (
        tuple(sorted({pair[side] for each in squares.values() for pair in each})) for side in (0, 1)
    )
    together = len(names) > MOST
    charts = tuple(
        HeatMap(label, sources, targets, scale, each, together) for label, each in squares.items() if each
    )
    return Figure("pairs", ordered[0].dataset, "sources down, targets across", headers, charts)


def _names(matrices: Sequence[ResultMatrix]) -> dict[str, str]:
    """Body -> its name, or its structure where there are too many bodies."""
    bodies = {name for each in matrices for info in each.cases for name in (info.source, info.target)}
    if len(bodies) <= MOST:
        return {name: name for name in bodies}
    structures: dict[str, str] = {}
    for each in matrices:
        for row in each.rows:
            structures |= case_metadata.read(row.paths).structures
    return {name: structures.get(name, UNKNOWN) for name in bodies}


# ------------------------------------------------------------------------------------------------ joints
@dataclass(frozen=True)
class _JointErrors:
    """Errors by joint on targets of one structure. means: joint -> label -> mean. parts: joint -> the
    results of all structures. here: ``(cases,)`` bool, of the structure."""

    matrix: ResultMatrix
    structure: str
    targets: tuple[str, ...]
    means: Mapping[str, Mapping[str, Mean]]
    parts: Mapping[str, ResultMatrix]
    here: np.ndarray

    def marks(self, value: str, label: str, places: Mapping[str, float]) -> tuple[Mark, ...]:
        """The marks of one method; joint -> its place in the chart."""
        marks = []
        for joint, place in places.items():
            if (mean := self.means.get(joint, {}).get(label)) is not None:
                part = self.parts[joint]
                numbers = np.where(self.here, values.numbers_at(part, value)(label, ""), np.nan)
                cases = values.worst(part, value, numbers, f"error of {joint}, {part.values[value].unit}")
                marks.append(Mark(label, place, mean, replace(cases, value=""), joint))
        return tuple(marks)


def _by_joint(
    matrix: ResultMatrix, value: str, structures: Mapping[str, str], labels: Sequence[str]
) -> list[_JointErrors]:
    """The errors of these structures, of those that have any."""
    parts = breakdown(replace(matrix, values={value: matrix.values[value]}), "joint")
    errors = []
    for structure in labels:
        here = np.array([structures[info.id] == structure for info in matrix.cases])
        means = {part.part: values.means(part.restricted(here, part.part), value) for part in parts}
        means = {joint: each for joint, each in means.items() if each}
        targets = sorted({info.target for info, chosen in zip(matrix.cases, here, strict=True) if chosen})
        if means:
            by_name = {part.part: part for part in parts}
            errors.append(_JointErrors(matrix, structure, tuple(targets), means, by_name, here))
    return errors


def _shown_structures(
    matrix: ResultMatrix, structures: Mapping[str, str], structure: str | None, most: int
) -> list[str]:
    """The named structure, or those of most cases."""
    counts = Counter(structures.values())
    if structure is not None and structure not in counts:
        raise BenchError(
            f"{matrix.dataset}, {matrix.split}: no target is of structure {structure}; there are "
            f"{', '.join(sorted(counts))}"
        )
    return [structure] if structure is not None else [name for name, _ in counts.most_common(most)]


def skeletons(
    matrices: Sequence[ResultMatrix],
    value: str,
    bodies: Mapping[str, Character],
    structure: str | None = None,
    order: Sequence[str] = (),
    most: int = 1,
) -> Figure:
    """A skeleton per method, its joints sized and coloured by their errors, on one scale; of every split
    and structure. Controls are left out unless there is nothing else.

    bodies: name -> character, of the data set; the first target of a structure is drawn. structure: of the
    targets; those of most cases, so many, where none is given. Raises NothingToDraw where no method has the
    value, and where the data set has no such body.
    """
    what = values.value_of(matrices, value, "joint")
    by_matrix = [
        errors
        for matrix in values.in_order([each for each in matrices if value in each.values], order)
        for structures in [_structures(matrix, bodies)]
        for errors in _by_joint(
            matrix, value, structures, _shown_structures(matrix, structures, structure, most)
        )
    ]
    if not by_matrix:
        raise NothingToDraw(f"no method has {value} on these results; bench table says why")
    drawn = [
        (each, bodies[name])
        for each in by_matrix
        for name in [name for name in each.targets if name in bodies][:1]
    ]
    if not drawn:
        of = by_matrix[0].structure if by_matrix[0].structure != UNKNOWN else "these"
        raise NothingToDraw(f"the data set has no body of {of}")
    headers = values.methods([each.matrix for each, _ in drawn])
    shown = [label for label in headers if not headers[label].method.control] or list(headers)
    marks = {
        (k, label): tuple(sorted(each.marks(value, label, joints), key=lambda mark: mark.mean.value))
        for k, (each, body) in enumerate(drawn)
        for joints in [{name: float(joint) for joint, name in enumerate(body.skeleton.names)}]
        for label in shown
    }
    numbers: dict[str, list[float]] = {}
    for (_, label), each in marks.items():
        numbers.setdefault(label, []).extend(mark.mean.value for mark in each)
    ranked = values.ranked([each.matrix for each, _ in drawn])
    scale = ColourScale(what.axis, 0.0, max(axis_limits.colour_end(numbers, ranked, JOINTS), NOTHING))
    charts = []
    for (k, label), each in marks.items():
        errors, body = drawn[k]
        bones = tuple((p, joint) for joint, p in enumerate(body.skeleton.parents.tolist()) if p >= 0)
        chart = SkeletonChart(
            errors.matrix.split, label, body.name, _flat(body), bones, scale, each, errors.structure
        )
        charts += [chart] if each else []
    return Figure("joints", drawn[0][0].matrix.dataset, _title(drawn[0][0]), headers, tuple(charts))


def _title(errors: _JointErrors) -> str:
    clips = len({info.clip for info, here in zip(errors.matrix.cases, errors.here, strict=True) if here})
    return f"{errors.matrix.split}, targets of {errors.structure}, {clips} clips"


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
