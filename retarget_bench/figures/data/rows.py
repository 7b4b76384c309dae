"""Charts that compare methods: by kind, by rank, over clips, and against speed."""

import math
from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.breakdown import breakdown
from retarget_bench.analysis.summary import Mean, split_summary
from retarget_bench.figures import axis_limits
from retarget_bench.figures.data import values
from retarget_bench.figures.data.model import (
    Axis,
    Box,
    BoxChart,
    Cases,
    Figure,
    Mark,
    NothingToDraw,
    PointChart,
    RowChart,
)  # fmt: skip
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.result_matrix import ResultMatrix

DOTS = 60
"""With more clips only those outside the whiskers are marks."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


# ------------------------------------------------------------------------------------------------- kinds
def kinds(matrices: Sequence[ResultMatrix], value: str, order: Sequence[str] = ()) -> Figure:
    """A row per kind of performance and a mark per method, a chart per split; the kind with the median
    method's largest error at the top. Raises NothingToDraw where no result has the value."""
    what = values.value_of(matrices, value)
    ordered = values.in_order([each for each in matrices if value in each.values], order)
    charts = []
    for matrix in ordered:
        parts = {part.part: values.means(part, value) for part in breakdown(matrix.narrowed(value), "kind")}
        middle = {
            kind: median(mean.value for mean in each.values()) for kind, each in parts.items() if each
        }
        worse = what.losses(np.array(list(middle.values()))).tolist()
        names = [kind for _, kind in sorted(zip(worse, middle, strict=True), key=lambda each: -each[0])]
        marks = {
            label: tuple(
                Mark(label, row, mean, Cases(matrix.split, value, ("kind", kind)), kind)
                for row, kind in enumerate(names)
                if (mean := parts[kind].get(label)) is not None
            )
            for label in values.methods([matrix])
        }
        charts.append(_rows(matrix, matrix.split, names, marks, what))
    title = "by kind of performance"
    return Figure("kinds", ordered[0].dataset, title, values.methods(ordered), tuple(charts), "bars 95 %")


def _rows(
    matrix: ResultMatrix,
    title: str,
    names: Sequence[str],
    marks: Mapping[str, tuple[Mark, ...]],
    what: values.Value,
    **more: Any,
) -> RowChart:
    marks = {label: each for label, each in marks.items() if each}
    means = {label: [mark.mean for mark in each] for label, each in marks.items()}
    from_zero = not more.get("together")
    ends = axis_limits.limits(means, values.methods([matrix]), what.declared, from_zero=from_zero)
    return RowChart(matrix.split, title, Axis(what.axis, *ends), tuple(names), marks, **more)


# -------------------------------------------------------------------------------------------------- ties
def ties(matrices: Sequence[ResultMatrix], value: str, order: Sequence[str] = ()) -> Figure:
    """Methods from the best to the worst, then those that are not ranked; a bar joins those tied with the
    best to it. Raises NothingToDraw where nobody is ranked by the value, or results are not
    complete."""
    what = values.value_of(matrices, value)
    charts = []
    for matrix in values.in_order(matrices, order):
        section = split_summary(matrix.narrowed(value))
        if matrix.so_far or (ranking := section.rankings.get(value)) is None:
            continue
        means = {score.label: score.means[value] for score in section.scores if value in score.means}
        names = [*ranking.order, *(label for label in means if label not in ranking.order)]
        marks = {
            label: (
                Mark(
                    label, row, means[label], Cases(matrix.split, value), hollow=label not in ranking.order
                ),
            )
            for row, label in enumerate(names)
        }
        joined = (tuple(range(1 + len(ranking.tied))),) if ranking.tied and ranking.separable else ()
        title = f"{matrix.split}: {ranking.clips} clips, {ranking.cases} common cases"
        charts.append(_rows(matrix, title, names, marks, what, together=True, joined=joined))
    if not charts:
        why = f"nobody is ranked by {value}" if not any(each.so_far for each in matrices) else "cases lack"
        raise NothingToDraw(f"{why} in these results, so there are no ties to show")
    return Figure(
        "ties", matrices[0].dataset, "a bar joins what the data cannot tell from the best",
        values.methods(values.in_order(matrices, order)), tuple(charts), "lines 95 %; hollow: not ranked",
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------- speed
def speed(matrices: Sequence[ResultMatrix], value: str, order: Sequence[str] = ()) -> Figure:
    """A mark per method over its frames per second, a chart per split. Raises NothingToDraw where no method
    has both."""
    what = values.value_of(matrices, value)
    ordered = values.in_order(matrices, order)
    headers = values.methods(ordered)
    charts = []
    for matrix in ordered:
        section = split_summary(matrix.narrowed(value))
        marks = tuple(
            Mark(s.label, s.fps, s.means[value], Cases(matrix.split, value), hollow=bool(s.unranked))
            for s in section.scores
            if s.fps and value in s.means
        )
        if marks:
            ends = axis_limits.limits({m.method: [m.mean] for m in marks}, headers, what.declared)
            rates = [mark.at for mark in marks]
            x = Axis("frames per second, one thread", min(rates) / 1.5, max(rates) * 1.5, log=True)
            title = f"{matrix.split}: {section.clip_count} clips"
            front = best([mark for mark in marks if not mark.hollow], what.declared)
            charts.append(PointChart(matrix.split, title, x, Axis(what.axis, *ends), marks, tuple(front)))
    if not charts:
        raise NothingToDraw(
            f"no method of these results has {value} and a speed; bench run measures speed; predictions "
            "made elsewhere have none"
        )
    return Figure(
        "speed", ordered[0].dataset, "quality against speed", headers, tuple(charts),
        "bars 95 %; hollow: not ranked",
    )  # fmt: skip


def best(marks: Sequence[Mark], declared: DeclaredValue) -> list[Mark]:
    """Those that no other is faster than and better, slowest first."""
    worse = statistics.losses(
        np.array([mark.mean.value for mark in marks]), declared.better, declared.goal
    ).tolist()
    front: list[Mark] = []
    least = math.inf
    for mark, loss in sorted(zip(marks, worse, strict=True), key=lambda each: (-each[0].at, each[1])):
        if loss < least:
            front.append(mark)
            least = loss
    return front[::-1]


# ------------------------------------------------------------------------------------------------- clips
def clips(matrices: Sequence[ResultMatrix], value: str, order: Sequence[str] = ()) -> Figure:
    """The distribution of each method over clips: quantiles, and a mark per clip."""
    what = values.value_of(matrices, value)
    ordered = values.in_order([each for each in matrices if value in each.values], order)
    charts = []
    for matrix in ordered:
        per_clip = statistics.per_clip(values.common_numbers(matrix, value)[0], matrix.clips)
        names = list(dict.fromkeys(info.clip for info in matrix.cases))
        boxes, numbers = [], []
        for row, each in zip(matrix.rows, per_clip, strict=True):
            if (there := each[~np.isnan(each)]).size:
                numbers.append(there)
                boxes.append(_box(matrix.split, value, row.label, each, names))
        if boxes:
            end = axis_limits.top([float(np.quantile(each, 0.97)) for each in numbers])
            low = min(0.0, min(float(each.min()) for each in numbers))
            cut = max(float(each.max()) for each in numbers) > end
            charts.append(
                BoxChart(matrix.split, matrix.split, Axis(what.axis, low, end, cut=cut), tuple(boxes))
            )
    return Figure(
        "clips", ordered[0].dataset, "distribution over clips", values.methods(ordered), tuple(charts)
    )


def _box(split: str, value: str, label: str, numbers: np.ndarray, names: Sequence[str]) -> Box:
    there = ~np.isnan(numbers)
    quantiles = tuple(float(each) for each in np.quantile(numbers[there], QUANTILES))
    marks = tuple(
        Mark(
            label, clip, Mean(float(number), 1, 1), Cases(split, value, ("clip", names[clip])), names[clip]
        )
        for clip, number in enumerate(numbers)
        if there[clip] and (there.sum() <= DOTS or not quantiles[0] <= number <= quantiles[-1])
    )
    return Box(label, quantiles, marks)


def lift(mark: Mark) -> float:
    """Distance of a clip's mark from the middle of its row, in rows, lest marks hide each other."""
    return (mark.at * 0.618) % 1 / 2 - 0.25
