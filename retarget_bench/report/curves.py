"""Curves that results have over thresholds and over seconds."""

from __future__ import annotations

from collections.abc import Mapping

from markupsafe import Markup

from retarget_bench.analysis.summary import Mean
from retarget_bench.figures.axis_limits import top
from retarget_bench.report import charts
from retarget_bench.report.chapters import Chapter, Split
from retarget_bench.report.charts import ChartStyle, Frame, Scale
from retarget_bench.report.means import told, worst
from retarget_bench.report.pictures import Looks, Picture, by_split

WIDTH, HEIGHT = 360.0, 240.0
LEFT, RIGHT, BOTTOM, TOP = 46.0, 350.0, 200.0, 24.0
RECALL = {"pan_recall": "recall", "pan_contact_precision": "precision"}

Points = list[tuple[float, str, Mean]]
"""Of one curve: place, its index as results write it, and the mean there."""


def recall(chapter: Chapter, looks: Looks) -> Picture | None:
    """Foot contacts kept over how slow counts as planted, and how many of those are right."""
    found = []
    for split in chapter.splits:
        panels = []
        for value, name in RECALL.items():
            lines = _lines(split, value)
            if not lines:
                continue
            places = sorted({at for points in lines.values() for at, _, _ in points})
            frame = Frame(
                Scale(places[0], max(places[-1], places[0] * 1.01), LEFT, RIGHT, log=True),
                Scale(0.0, 1.0, BOTTOM, TOP),
                "slower is planted: squared step in 1/30 s, cm²",
                name,
                f"{split.name}: {name}",
            )
            panels.append(_chart(split, value, lines, frame, looks))
        found.append(("", panels))
    return Picture(
        "recall",
        "Foot contacts kept, over how slow counts as planted",
        "Recall is the share of the reference's foot contacts that an answer keeps, precision the share of "
        "an answer's contacts that the reference has. A foot that never moves has all the recall there is, "
        "so read both.",
        by_split(found),
    )


def growth(chapter: Chapter, looks: Looks) -> Picture | None:
    """The position error second by second."""
    drawn = []
    for split in chapter.splits:
        lines = _lines(split, "growth.world")
        if not lines or max(len(points) for points in lines.values()) < 2:
            continue
        places = [at for points in lines.values() for at, _, _ in points]
        frame = Frame(
            Scale(min(places), max(places), LEFT, RIGHT),
            Scale(
                0.0, top([max(mean.value for _, _, mean in each) for each in lines.values()]), BOTTOM, TOP
            ),
            "seconds from the beginning",
            "error, % of height",
            split.name,
        )
        drawn.append(_chart(split, "growth.world", lines, frame, looks))
    return Picture(
        "growth",
        "Error over time",
        "Whether a method loses its way the longer a clip lasts. Fewer clips reach the later seconds, so "
        "lines may step where short clips end; lines that leave the chart at its top are far worse.",
        by_split([("", drawn)]),
    )


def _lines(split: Split, value: str) -> dict[str, Points]:
    """Label -> its curve, of those that have it, in the order of the page."""
    curves = {score.label: score.curves.get(value, {}) for score in split.section.scores}
    return {
        label: sorted((float(index), index, mean) for index, mean in curves[label].items())
        for label in split.labels
        if curves.get(label)
    }


def _chart(split: Split, value: str, lines: Mapping[str, Points], frame: Frame, looks: Looks) -> Markup:
    """Lines with bands where all of a line has intervals, and a mark at every point that leads to cases."""
    bands, strokes, marks = [], [], []
    for label, points in lines.items():
        look = looks[label]
        bands += [_band(points, frame, look)]
        strokes.append(charts.line([(frame.x(at), frame.y(mean.value)) for at, _, mean in points], look))
        row = split.labels.index(label)
        for at, index, mean in points:
            behind = split.panel.numbers((value, index))[row]
            marks.append(
                charts.pick(
                    f"{label} at {at:g}: {told(mean, 3, split.panel.values[value].unit)}",
                    charts.mark(frame.x(at), frame.y(mean.value), look, 0.75),
                    split=split.name,
                    method=label,
                    worst=worst(behind, split.panel.values[value].better),
                    what=f"{split.panel.values[value].label} at {at:g}",
                )
            )
    names = ", ".join(f"{label} {points[-1][2].value:.3g}" for label, points in lines.items())
    alternative = f"{frame.title}. {frame.label_y} over {frame.label_x}; at the right end: {names}"
    return charts.svg(WIDTH, HEIGHT, alternative, frame.drawn(), *bands, *strokes, *marks)


def _band(points: Points, frame: Frame, look: ChartStyle) -> Markup:
    known = [(at, mean.interval) for at, _, mean in points if mean.interval is not None]
    if len(known) < len(points):
        return Markup()
    low = [(frame.x(at), frame.y(each.low)) for at, each in known]
    high = [(frame.x(at), frame.y(each.high)) for at, each in known]
    return charts.band(low, high, look)
