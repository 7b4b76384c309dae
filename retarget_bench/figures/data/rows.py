"""Charts that compare methods: by rank, by kind, over clips, and against speed."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from statistics import median

import numpy as np

from retarget_bench.analysis import statistics, summary
from retarget_bench.analysis.breakdown import breakdown
from retarget_bench.analysis.summary import Mean, MethodSummary, split_summary
from retarget_bench.figures import axis_limits
from retarget_bench.figures.data import values
from retarget_bench.figures.data.model import Axis, Cases, Chart, Figure, Mark, NothingToDraw, Series
from retarget_bench.figures.data.values import Styles
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.result_matrix import ResultMatrix

DOTS = 60
"""With more clips only those outside the whiskers are marks."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
LANES = 0.8
"""Of a row, what the marks of all methods share."""


def _rows(names: Sequence[str]) -> Axis:
    """An axis with a row for each name."""
    return Axis("", -0.5, len(names) - 0.5, ticks=tuple(enumerate(names)))


def _limits(
    series: Iterable[Series], styles: Styles, declared: DeclaredValue, *, from_zero: bool = True
) -> tuple[float, float]:
    """The ends of an axis of numbers, by the series that are shown without being asked for."""
    means = {each.method: [mark.mean for mark in each.marks] for each in series}
    kept = values.shown(means, styles)
    return axis_limits.limits({label: means[label] for label in kept}, declared, from_zero=from_zero)


# ------------------------------------------------------------------------------------------------- kinds
def kinds(matrices: Sequence[ResultMatrix], value: str, styles: Styles) -> Figure:
    """A row per kind of performance and a mark per method, a chart per split; the kind with the median
    method's largest error at the top. Raises NothingToDraw where no result has the value."""
    what = values.value_of(matrices, value)
    ordered = values.in_order([each for each in matrices if value in each.values], styles)
    charts = []
    for matrix in ordered:
        parts = breakdown(matrix.narrowed(value), "kind")
        labels = [row.label for row in matrix.rows]
        shown, why = values.shown(labels, styles), values.unranked(matrix)
        means = {part.part: values.means(part, value) for part in parts}
        means = {kind: each for kind, each in means.items() if {*shown} & each.keys()}
        middle = [median(m.value for label, m in each.items() if label in shown) for each in means.values()]
        worse = what.losses(np.array(middle)).tolist()
        names = [kind for _, kind in sorted(zip(worse, means, strict=True), key=lambda each: -each[0])]
        series = []
        for place, label in enumerate(labels):
            lane = LANES * ((place % len(shown) + 0.5) / len(shown) - 0.5)
            marks = tuple(
                Mark(row + lane, means[kind][label], Cases(matrix.split, value, ("kind", kind)), kind)
                for row, kind in enumerate(names)
                if label in means[kind]
            )
            series += [Series(label, label, marks, why[label])] if marks else []
        at, number = _rows(names), Axis(what.axis, *_limits(series, styles, what.declared))
        if series:
            charts.append(Chart(matrix.split, matrix.split, at, number, tuple(series), rows=True))
    return Figure("kinds", ordered[0].dataset, "by kind of performance", tuple(charts))


# -------------------------------------------------------------------------------------------------- ties
def ties(matrices: Sequence[ResultMatrix], value: str, styles: Styles) -> Figure:
    """Methods that are shown without being asked for, from the best to the worst, then those that are not
    ranked; a bar joins those tied with the best to it. Raises NothingToDraw where nobody is ranked by the
    value, or results are not complete."""
    what = values.value_of(matrices, value)
    charts = []
    for matrix in values.in_order(matrices, styles):
        section = split_summary(matrix.narrowed(value))
        if matrix.so_far or (ranking := section.rankings.get(value)) is None:
            continue
        means = {score.label: score.means[value] for score in section.scores if value in score.means}
        names = [*ranking.order, *(label for label in means if label not in ranking.order)]
        names = [label for label in names if label in values.shown(names, styles)]
        why = values.unranked(matrix, value)
        series = tuple(
            Series(label, label, (Mark(row, means[label], Cases(matrix.split, value)),), why[label])
            for row, label in enumerate(names)
        )
        rows = _rows([each.title for each in series])
        ends = _limits(series, styles, what.declared, from_zero=False)
        title = f"{matrix.split}: {ranking.clips} clips, {ranking.cases} common cases"
        joined = {ranking.best, *ranking.tied} if ranking.separable else set()
        tied = tuple(row for row, label in enumerate(names) if label in joined)
        number = Axis(what.axis, *ends)
        charts.append(Chart(matrix.split, title, rows, number, series, rows=True, named=True, tied=tied))
    if not charts:
        why_not = (
            f"nobody is ranked by {value}" if not any(each.so_far for each in matrices) else "cases lack"
        )
        raise NothingToDraw(f"{why_not} in these results, so there are no ties to show")
    title = "a bar joins what the data cannot tell from the best"
    return Figure("ties", matrices[0].dataset, title, tuple(charts))


# ------------------------------------------------------------------------------------------------- speed
def speed(matrices: Sequence[ResultMatrix], value: str, styles: Styles) -> Figure:
    """A mark per method over its frames per second, a chart per split, and a guide through those that no
    ranked method beats in both. Speeds that are not to be compared are left out, which a note says. Raises
    NothingToDraw where no method has both."""
    what = values.value_of(matrices, value)
    ordered = values.in_order(matrices, styles)
    charts: list[Chart] = []
    notes: list[str] = []
    for matrix in ordered:
        section = split_summary(matrix.narrowed(value))
        why = values.unranked(matrix, value)
        timed = [score for score in section.scores if score.fps and value in score.means]
        slow = {score.label: reason for score in timed if (reason := section.slower(score))}
        notes += [f"left out of {matrix.split}: {label}, {reason}" for label, reason in slow.items()]
        series = tuple(
            Series(score.label, score.label, (_timed(score, value, matrix.split),), why[score.label])
            for score in timed
            if score.label not in slow
        )
        if series:
            rates = [each.marks[0].at for each in series]
            x = Axis("frames per second, one thread", min(rates) / 1.5, max(rates) * 1.5, log=True)
            y = Axis(what.axis, *_limits(series, styles, what.declared))
            title = f"{matrix.split}: {section.clip_count} clips"
            front = best([each.marks[0] for each in series if not each.unranked], what.declared)
            charts.append(Chart(matrix.split, title, x, y, series, guide=_steps(front)))
    if not charts:
        raise NothingToDraw(
            f"no method of these results has {value} and a speed; bench run measures speed; predictions "
            "made elsewhere have none"
        )
    return Figure("speed", ordered[0].dataset, "quality against speed", tuple(charts), notes=tuple(notes))


def _timed(score: MethodSummary, value: str, split: str) -> Mark:
    fps = score.fps or 0.0
    return Mark(fps, score.means[value], Cases(split, value), f"{fps:,.0f} frames per second")


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


def _steps(front: Sequence[Mark]) -> tuple[tuple[float, float], ...]:
    """The corners of the line through marks that changes its height at once."""
    points = [(mark.at, mark.mean.value) for mark in front]
    corners = points[:1]
    for before, point in pairwise(points):
        corners += [(before[0], point[1]), point]
    return tuple(corners)


# ------------------------------------------------------------------------------------------------- clips
def clips(matrices: Sequence[ResultMatrix], value: str, styles: Styles) -> Figure:
    """The distribution over clips of each method that is shown without being asked for: quantiles, and a
    mark per clip."""
    what = values.value_of(matrices, value)
    ordered = values.in_order([each for each in matrices if value in each.values], styles)
    charts = []
    for matrix in ordered:
        numbers = summary.common_numbers(matrix, value)[0]
        kept = values.shown((row.label for row in matrix.rows), styles)
        per_clip = {
            row.label: each
            for row, each in zip(matrix.rows, statistics.per_clip(numbers, matrix.clips), strict=True)
            if row.label in kept and not np.isnan(each).all()
        }
        names = list(dict.fromkeys(info.clip for info in matrix.cases))
        why = values.unranked(matrix, value)
        series = tuple(
            _box(matrix.split, value, label, row, each, names, why[label])
            for row, (label, each) in enumerate(per_clip.items())
        )
        if series:
            end = axis_limits.top([float(np.nanquantile(each, 0.97)) for each in per_clip.values()])
            low = min(0.0, min(float(np.nanmin(each)) for each in per_clip.values()))
            rows, number = _rows([each.title for each in series]), Axis(what.axis, low, end)
            charts.append(
                Chart(
                    matrix.split,
                    f"{matrix.split}: {len(names)} clips",
                    rows,
                    number,
                    series,
                    rows=True,
                    named=True,
                )
            )
    return Figure("clips", ordered[0].dataset, "distribution over clips", tuple(charts))


def _box(
    split: str, value: str, label: str, row: int, numbers: np.ndarray, names: Sequence[str], unranked: str
) -> Series:
    there = ~np.isnan(numbers)
    quantiles = tuple(float(each) for each in np.quantile(numbers[there], QUANTILES))
    marks = tuple(
        Mark(
            row + _lift(clip), Mean(float(number), 1, 1), Cases(split, value, ("clip", names[clip])),
            names[clip],
        )
        for clip, number in enumerate(numbers)
        if there[clip] and (there.sum() <= DOTS or not quantiles[0] <= number <= quantiles[-1])
    )  # fmt: skip
    return Series(label, label, marks, unranked, box=(row, quantiles))


def _lift(clip: int) -> float:
    """Distance of a clip's mark from the middle of its row, in rows, lest marks hide each other."""
    return (clip * 0.618) % 1 / 2 - 0.25
