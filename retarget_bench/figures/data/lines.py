"""Curves: contacts over thresholds, errors over seconds, and errors of tasks over their levels."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from statistics import fmean
from typing import TYPE_CHECKING

import numpy as np

from retarget_bench.analysis.breakdown import breakdown, structures_of
from retarget_bench.analysis.summary import Mean, SplitSummary, split_summary
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.tasks import definitions
from retarget_bench.evaluation.tasks.definitions import MAJOR
from retarget_bench.figures import axis_limits
from retarget_bench.figures.data import values
from retarget_bench.figures.data.model import Axis, Cases, Chart, Figure, Mark, NothingToDraw, Series
from retarget_bench.figures.data.values import Styles
from retarget_bench.results import case_metadata
from retarget_bench.results.result_matrix import ResultMatrix

if TYPE_CHECKING:
    from retarget_bench.analysis.seen_unseen import SeenPart
    from retarget_bench.results.store import ResultPaths

CONTACTS = {"pan_recall": "recall", "pan_contact_precision": "precision"}
"""Value -> what its charts are called. A foot that never moves has recall 1; hence both."""
THRESHOLDS = {"": "squared step in 1/30 s, cm²", "_h": "step in 1/30 s, heights"}
"""Suffix of the values -> label of the threshold that a planted foot stays below."""
BEFORE, AFTER, MISSING = "given_cm", "restored_cm", "restored_cm.missing"
TITLES = {AFTER: "all joints", MISSING: "joints that are not given"}
ROOM = 1.08
"""Height of the chart of denoising over the noise itself: marks above it have added noise."""
FEW = 2
"""Structures named in a legend; of more it gives the number."""
SIDE = 0.02
"""Of an axis, what is left free at its ends."""
TICKS = 8
"""Most ticks of an axis of seconds."""
MEANS = ("means over clips",)


# ------------------------------------------------------------------------------------------------ curves
def recall(matrices: Sequence[ResultMatrix], styles: Styles, by_height: bool = False) -> Figure:
    """Foot contacts kept, over how slow counts as planted (PAN's Figure 7): recall, then precision, a chart
    per split each.

    by_height: thresholds of speed in heights, not squared ones in centimetres. Raises NothingToDraw.
    """
    suffix = "_h" if by_height else ""
    charts: list[Chart] = []
    ordered = values.in_order([each for each in matrices if f"pan_recall{suffix}" in each.values], styles)
    for value, name in CONTACTS.items():
        for each in ordered:
            section, series = _curves(each, value + suffix)
            if series:
                x = _across(THRESHOLDS[suffix], series, log=True)
                y = Axis(f"{name} of foot contacts", -SIDE, 1 + SIDE)
                title = f"{each.split}: {section.clip_count} clips, {section.pair_count} pairs"
                charts.append(Chart(each.split, title, x, y, series, joined=True))
    if not charts:
        raise NothingToDraw(
            f"these results have no pan_recall{suffix}, which the metric pan_contact gives; bench run with "
            "-m pan_contact, or without -m, computes it from the predictions that there are"
        )
    title = "foot contacts kept, over how slow counts as planted"
    return Figure("recall", ordered[0].dataset, title, tuple(charts), notes=MEANS)


def growth(matrices: Sequence[ResultMatrix], value: str, styles: Styles) -> Figure:
    """A value over the seconds of a clip, a chart per split on one scale; later seconds are those of longer
    clips alone. Raises NothingToDraw."""
    what = values.value_of(matrices, value, "second")
    ordered = values.in_order([each for each in matrices if value in each.values], styles)
    curves = [(each, *_curves(each, value)) for each in ordered]
    means: dict[str, list[Mean]] = {}
    for _, _, series in curves:
        for each in series:
            means.setdefault(each.method, []).extend(mark.mean for mark in each.marks)
    kept = {label: means[label] for label in values.shown(means, styles)}
    y = Axis(what.axis, *axis_limits.limits(kept, what.declared, bands=True))
    charts = []
    for matrix, section, series in curves:
        if series:
            x, title = (
                _across("end of the second, s", series),
                f"{matrix.split}: {section.clip_count} clips",
            )
            charts.append(Chart(matrix.split, title, x, y, series, joined=True))
    return Figure("growth", ordered[0].dataset, "error over time", tuple(charts), notes=MEANS)


def _curves(matrix: ResultMatrix, value: str) -> tuple[SplitSummary, tuple[Series, ...]]:
    """The summary of a split, and the curve of every method that has one: as far as its points have
    intervals, where any has."""
    section = split_summary(matrix.narrowed(value))
    if value not in matrix.values:
        return section, ()
    label, numbers = matrix.values[value].label, values.numbers_at(matrix, value)
    series = []
    for score in section.scores:
        points = sorted((float(at), at, mean) for at, mean in score.curves.get(value, {}).items())
        marks = tuple(
            Mark(
                place, mean,
                values.worst(matrix, value, numbers(score.label, at), f"{label} at {place:g}"),
                f"at {place:g}",
            )
            for place, at, mean in points
        )  # fmt: skip
        sure = tuple(mark for mark in marks if mark.mean.interval is not None)
        series += [Series(score.label, score.label, sure or marks, score.unranked)] if marks else []
    return section, tuple(series)


def _across(label: str, series: Sequence[Series], *, log: bool = False) -> Axis:
    """The x axis of curves; where it is logarithmic every point is a tick, else a few."""
    places = sorted({mark.at for each in series for mark in each.marks})
    low, high = places[0], places[-1]
    if log:
        room = max(high / low, 1.01) ** (2 * SIDE)
        return Axis(label, low / room, high * room, log=True, ticks=tuple((at, f"{at:g}") for at in places))
    room = 2 * SIDE * (high - low) or 0.5
    few = places[:: math.ceil(len(places) / TICKS)]
    return Axis(label, low - room, high + room, ticks=tuple((at, f"{at:g}") for at in few))


# ------------------------------------------------------------------------------------------------ levels
def denoise(matrix: ResultMatrix, styles: Styles, halves: Sequence[SeenPart] = ()) -> Figure:
    """The error after denoising over the error before (HuMoT's Figure 8); the diagonal gives the source
    back.

    halves: what trained methods do on structures that training had and had not; theirs are two lines, each
    over the error of what that half was given. Raises NothingToDraw where no result has both errors.
    """
    (matrix,) = values.in_order([matrix], styles)
    sections = _levels(matrix)
    levels = _source_errors(sections)
    if not levels:
        raise NothingToDraw(
            f"these results have no {BEFORE} beside {AFTER}, which the metric restoration gives; bench "
            "task denoise with -m restoration, or without -m, computes them"
        )
    places = {(half.label, half.seen): _source_errors(half.sections) for half in halves}
    most = max(*levels.values(), *(each for half in places.values() for each in half.values()), 1e-3)
    shown = [section for section in sections if section.part in levels]
    series = _level_series(matrix, shown, halves, AFTER, levels, places)
    numbers = {name: definitions.level_number(name) for name in levels}
    ticks = [(levels[name], f"{number:g}") for name, number in numbers.items() if number is not None]
    chart = Chart(
        matrix.split,
        matrix.split,
        Axis("error before: joints of the noisy source, cm", -SIDE * most, (1 + SIDE) * most),
        Axis("error after: joints of the answer, cm", -SIDE * most, ROOM * most),
        series,
        joined=True,
        guide=((0.0, 0.0), (most, most)),
        above=("standard deviation of the noise on each coordinate, cm", tuple(ticks)),
    )
    title = f"{shown[0].clip_count} clips at every level"
    return Figure("denoise", matrix.dataset, title, (chart,), notes=MEANS)


def joint_completion(matrix: ResultMatrix, styles: Styles, halves: Sequence[SeenPart] = ()) -> Figure:
    """The error over the proportion of joints that are given (HuMoT's Figure 9), of all joints and of those
    that are missing; beside the lines, which are of random draws, the major joints of its Figure 12.

    halves: as for ``denoise``. Raises NothingToDraw where no result has the errors.
    """
    (matrix,) = values.in_order([matrix], styles)
    sections = _levels(matrix)
    shares = {each.part: at for each in sections if (at := definitions.level_number(each.part)) is not None}
    share = major_share(row.paths for row in matrix.rows)
    extra = {MAJOR: share} if share is not None else {}
    charts = []
    for value, title in TITLES.items():
        series = _level_series(matrix, sections, halves, value, shares, extra=extra)
        if not series and value == AFTER:
            raise NothingToDraw(
                "these results have no restored_cm, which the metric restoration gives; a "
                "run that names it among --metrics, or no metric, computes it"
            )
        shown = values.shown((each.method for each in series), styles)
        highest = [
            max(m.mean.value for m in each.marks) for each in series if each.marks and each.method in shown
        ]
        end = 1.05 * axis_limits.top(highest, 3)
        x = Axis(
            "joints given, per cent" + (f" (large: {MAJOR} joints)" if extra else ""), 0.0, 100 * (1 + SIDE)
        )
        y = Axis("error, cm", -SIDE * end, end)
        charts += [Chart(matrix.split, title, x, y, series, joined=True)] if series else []
    title = f"{sections[0].clip_count} clips at every level"
    return Figure("joint-completion", matrix.dataset, title, tuple(charts), notes=MEANS)


def major_share(places: Iterable[ResultPaths]) -> float | None:
    """Per cent of the joints that the major ones are, on average over cases; None where there are none."""
    shares = [
        100.0 * each["joints"] / each["of"]
        for place in places
        for each in case_metadata.read(place).conditions.values()
        if MAJOR in each
    ]
    return fmean(shares) if shares else None


def _levels(matrix: ResultMatrix) -> list[SplitSummary]:
    try:
        return [split_summary(part) for part in breakdown(matrix, "level")]
    except BenchError as error:
        raise NothingToDraw(str(error)) from error


def _source_errors(sections: Iterable[SplitSummary]) -> dict[str, float]:
    """Level -> the error of its sources, of a method that answered most cases."""
    numbers = {}
    for section in sections:
        levels = [
            (mean.n, mean.value)
            for score in section.scores
            if AFTER in score.means and (mean := score.means.get(BEFORE)) is not None
        ]
        if levels:
            numbers[section.part] = max(levels)[1]
    return numbers


def _level_series(
    matrix: ResultMatrix,
    sections: Sequence[SplitSummary],
    split_parts: Sequence[SeenPart],
    value: str,
    at: Mapping[str, float],
    places: Mapping[tuple[str, bool], Mapping[str, float]] | None = None,
    extra: Mapping[str, float] | None = None,
) -> tuple[Series, ...]:
    """A line per method that has the value anywhere; two of methods that ``split_parts`` has.

    at: level -> its place. places: half -> its own places. extra: level -> place of what stands beside
    lines.
    """
    series = []
    for label, why in values.unranked(matrix).items():
        halves: list[SeenPart | None] = [each for each in split_parts if each.label == label] or [None]
        for half in halves:
            own = (places or {}).get((label, half.seen), at) if half else at
            parts = half.sections if half else sections
            marks = _level_marks(matrix, parts, half, label, value, own)
            beside = _level_marks(matrix, parts, half, label, value, extra or {})
            if marks or beside:
                unseen = half is not None and not half.seen
                series.append(Series(label, _name(label, half), marks, why, unseen, beside))
    return tuple(series)


def _level_marks(
    matrix: ResultMatrix,
    sections: Sequence[SplitSummary],
    half: SeenPart | None,
    label: str,
    value: str,
    at: Mapping[str, float],
) -> tuple[Mark, ...]:
    marks = []
    for section in sections:
        mean = next((s.means.get(value) for s in section.scores if s.label == label), None)
        if mean is not None and section.part in at:
            level = section.part
            cases = Cases(matrix.split, value, ("level", level))
            cases = cases if half is None else _half_cases(matrix, half, value, level)
            marks.append(Mark(at[level], mean, cases, level))
    return tuple(sorted(marks, key=lambda mark: mark.at))


def _half_cases(matrix: ResultMatrix, half: SeenPart, value: str, level: str) -> Cases:
    """The worst cases of one level on structures that training had, or had not."""
    structure_of = structures_of(matrix)
    (part,) = (each for each in breakdown(matrix, "level") if each.part == level)
    ids = {info.id for info in part.cases if structure_of[info.id] in half.structures}
    numbers = values.numbers_at(matrix, value)(half.label, "")
    shown = np.where([info.id in ids for info in matrix.cases], numbers, np.nan)
    return values.worst(matrix, value, shown, f"{matrix.values[value].label}, {level}")


def _name(label: str, half: SeenPart | None) -> str:
    """The label, and which half it is of."""
    if half is None:
        return label
    few = len(half.structures) <= FEW
    which = ", ".join(half.structures) if few else f"{len(half.structures)} structures"
    return f"{label} ({'seen' if half.seen else 'unseen'}: {which})"
