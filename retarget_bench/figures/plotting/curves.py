"""Charts with axes: lines, rows of marks, and points."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget_bench.figures.data.model import (
    Axis,
    BoxChart,
    Figure,
    Line,
    LineChart,
    Mark,
    PointChart,
    RowChart,
)
from retarget_bench.figures.data.rows import lift
from retarget_bench.figures.plotting import canvas, edges
from retarget_bench.figures.plotting.edges import Looks, filled

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

SHARE = 0.7
"""Of a row's height, what its marks share."""
STEP = 11.0
"""Points between two bars of ties."""
HEIGHTS = {"recall": 1.9, "denoise": 3.0, "upsample": 2.6, "growth": 2.3}
"""Inches of a panel of lines."""
WIDE = {"denoise": 4.2, "upsample": 3.0}
"""Inches that a panel is to have at least; 1.9 otherwise."""


# ------------------------------------------------------------------------------------------------- lines
def lines(path: Path, data: Figure, page: canvas.Page) -> None:
    """A panel per chart; a line per method with a band where all of it has intervals."""
    charts = [each for each in data.charts if isinstance(each, LineChart)]
    shown, down = _arranged(charts, page.across(WIDE.get(data.kind, 1.9)))
    looks = canvas.looks(data.methods, page)
    height = 0.75 * min(page.width, 4.2) if data.kind == "denoise" else HEIGHTS[data.kind] * down
    with canvas.drawn(path, page.width, 0.5 + height) as figure:
        across = len(shown) // down
        grid = figure.subplots(down, across, squeeze=False)
        for at, (axes, chart) in enumerate(zip(grid.flat, shown, strict=True)):
            if chart is None:
                axes.set_visible(False)
                continue
            if chart.diagonal:
                ends = [0, min(chart.x.high, chart.y.high)]
                axes.plot(ends, ends, color="0.6", linewidth=0.8, linestyle=(0, (1, 2)), zorder=1)
            for line in chart.lines:
                _line(axes, line, looks)
            _axis(axes.xaxis, chart.x, whole=data.kind == "growth")
            _axis(axes.yaxis, chart.y)
            axes.set_title(chart.title)
            over, left = at - across, at - 1 if at % across else -1
            if over >= 0 and (above := shown[over]) is not None and above.x == chart.x:
                grid.flat[over].set_xlabel("")
                grid.flat[over].tick_params(labelbottom=False)
                axes.set_title("" if above.title == chart.title else chart.title)
            if left >= 0 and (beside := shown[left]) is not None and beside.y == chart.y:
                axes.set_ylabel("")
                axes.tick_params(labelleft=False)
            if chart.above is not None:
                label, ticks = chart.above
                top = axes.secondary_xaxis("top")
                top.set_xticks([at for at, _ in ticks], [text for _, text in ticks])
                top.set_xlabel(label)
                axes.set_title("")
        both = [(axes, chart) for axes, chart in zip(grid.flat, shown, strict=True) if chart is not None]
        edges.above([axes for axes, _ in both], [chart.far for _, chart in both], looks)
        _finished(figure, data, page)


def _arranged(charts: Sequence[LineChart], most: int) -> tuple[list[LineChart | None], int]:
    """Charts row by row, and how many rows: by what their y axes show, splits side by side; where these
    have no room a row per split."""
    labels = dict.fromkeys(chart.y.label for chart in charts)
    groups = [[chart for chart in charts if chart.y.label == label] for label in labels]
    if len(groups) > 1 and len(groups[0]) > most:
        splits = dict.fromkeys(chart.split for chart in charts)
        groups = [[chart for chart in charts if chart.split == split] for split in splits]
    across = min(max(map(len, groups)), max(most, len(groups)))
    rows = [group[at : at + across] for group in groups for at in range(0, len(group), across)]
    return [chart for row in rows for chart in [*row, *[None] * (across - len(row))]], len(rows)


def _line(axes: Any, line: Line, looks: Looks) -> None:
    look = dict(looks[line.method])
    if line.seen is False:
        look |= {"linestyle": "--", "markerfacecolor": "white"}
    at = [mark.at for mark in line.marks]
    axes.plot(at, [mark.mean.value for mark in line.marks], label=canvas.told(line.name), **look)
    if line.banded:
        spans = [mark.mean.interval for mark in line.marks if mark.mean.interval is not None]
        low, high = [span.low for span in spans], [span.high for span in spans]
        axes.fill_between(at, low, high, color=look["color"], alpha=0.12, linewidth=0)
    for mark in line.extra:
        axes.plot([mark.at], [mark.mean.value], **look | {"markerfacecolor": "white", "markersize": 6})


# -------------------------------------------------------------------------------------------------- rows
def rows(path: Path, data: Figure, page: canvas.Page) -> None:
    """Rows from top to bottom, in each a mark per method with its interval; bars at the right join methods
    that the data cannot tell apart."""
    charts = [each for each in data.charts if isinstance(each, RowChart)]
    alone = charts[0].together or len(charts) == 1
    across = 1 if alone else min(len(charts), page.across(2.2))
    groups = [charts[first : first + across] for first in range(0, len(charts), across)]
    row = 0.19 if alone else 0.15
    heights = [0.62 + row * max(len(chart.rows) for chart in group) for group in groups]
    looks = canvas.looks(data.methods, page)
    with canvas.drawn(path, page.width, sum(heights) + 0.2) as figure:
        grid = figure.subplots(len(groups), across, squeeze=False, height_ratios=heights)
        for axes, chart in zip(grid.flat, charts, strict=False):
            for place, (label, marks) in enumerate(chart.marks.items()):
                shift = 0.0 if chart.together else SHARE * ((place + 0.5) / len(chart.marks) - 0.5)
                _row_marks(axes, label, marks, shift, looks, named=not chart.together)
            for at in range(0, len(chart.rows), 2) if not chart.together else ():
                axes.axhspan(at - 0.5, at + 0.5, color="0.5", alpha=0.08, linewidth=0)
            _axis(axes.xaxis, chart.axis, width=0.6 * page.width / across)
            axes.set(title=chart.title, ylim=(len(chart.rows) - 0.5, -0.5))
            axes.set_yticks(range(len(chart.rows)), [canvas.told(each) for each in chart.rows])
            axes.tick_params(axis="y", length=0)
            axes.grid(visible=False, axis="y")
            _bars(axes, chart.joined, edges.beside(axes, chart.far, looks))
        for axes in grid.flat[len(charts) :]:
            axes.set_visible(False)
        _finished(figure, data, page)


def _row_marks(
    axes: Any, label: str, marks: Sequence[Mark], shift: float, looks: Looks, *, named: bool
) -> None:
    look = {**filled(marks[0], looks), **({"label": canvas.told(label)} if named else {})}
    axes.plot([mark.mean.value for mark in marks], [mark.at + shift for mark in marks], **look)
    spans = [(mark.at + shift, mark.mean.interval) for mark in marks if mark.mean.interval is not None]
    axes.hlines(
        [at for at, _ in spans], [span.low for _, span in spans], [span.high for _, span in spans],
        color=look["color"], linewidth=0.9 if named else 1.2,
    )  # fmt: skip


def _bars(axes: Any, groups: Sequence[Sequence[int]], taken: float) -> None:
    """A bar per group at the right of the panel, with a dot for each of its members.

    taken: points at the panel's right that numbers stand on.
    """
    from matplotlib.transforms import ScaledTranslation

    for place, group in enumerate(groups):
        out = (taken + STEP * (place + 0.7)) / 72.0
        across = axes.get_yaxis_transform() + ScaledTranslation(out, 0.0, axes.figure.dpi_scale_trans)
        axes.plot([1.0] * len(group), group, transform=across, clip_on=False, color="0.15", linewidth=1.6,
                  marker="o", markersize=3)  # fmt: skip


# ------------------------------------------------------------------------------------------------ points
def points(path: Path, data: Figure, page: canvas.Page) -> None:
    """A mark per method with its interval upwards; faint steps join those that no other beats in both."""
    charts = [each for each in data.charts if isinstance(each, PointChart)]
    across = min(len(charts), page.across(1.9))
    down = -(-len(charts) // across)
    looks = canvas.looks(data.methods, page)
    with canvas.drawn(path, page.width, 0.4 + 2.1 * down) as figure:
        grid = figure.subplots(down, across, squeeze=False)
        for at, (axes, chart) in enumerate(zip(grid.flat, charts, strict=False)):
            for mark in chart.marks:
                look = filled(mark, looks) | {"markersize": 5.5, "label": canvas.told(mark.method)}
                axes.plot([mark.at], [mark.mean.value], **look, zorder=3)
                if (span := mark.mean.interval) is not None:
                    axes.vlines(mark.at, span.low, span.high, color=look["color"], linewidth=0.9)
            if len(chart.front) > 1:
                front = [(mark.at, mark.mean.value) for mark in chart.front]
                axes.step(*zip(*front, strict=True), where="pre", color="0.7", linewidth=0.8, zorder=1)
            axes.set_title(chart.title)
            _axis(axes.xaxis, chart.x)
            _axis(axes.yaxis, chart.y, told=at % across == 0)
        edges.above(grid.flat, [chart.far for chart in charts], looks)
        for axes in grid.flat[len(charts) :]:
            axes.set_visible(False)
        _finished(figure, data, page)


# ------------------------------------------------------------------------------------------------- boxes
def boxes(path: Path, data: Figure, page: canvas.Page) -> None:
    """A box per method with its median, whiskers from 5 to 95 %, and a dot per clip."""
    charts = [each for each in data.charts if isinstance(each, BoxChart)]
    heights = [0.62 + 0.19 * len(chart.boxes) for chart in charts]
    looks = canvas.looks(data.methods, page)
    with canvas.drawn(path, page.width, sum(heights) + 0.2) as figure:
        grid = figure.subplots(len(charts), 1, squeeze=False, height_ratios=heights).flat
        for axes, chart in zip(grid, charts, strict=True):
            for row, box in enumerate(chart.boxes):
                colour = looks[box.method]["color"]
                low, first, middle, third, high = box.quantiles
                axes.plot([low, high], [row, row], color=colour, linewidth=0.9)
                axes.barh(row, third - first, 0.6, first, color=colour, alpha=0.2)
                axes.plot([middle, middle], [row - 0.3, row + 0.3], color=colour, linewidth=1.6)
                for mark in box.marks:
                    at, number = row + lift(mark), min(mark.mean.value, chart.axis.high)
                    shape = ">" if chart.axis.beyond(mark) else "o"
                    axes.plot([number], [at], shape, color=colour, markersize=2, alpha=0.6, clip_on=False)
            _axis(axes.xaxis, chart.axis)
            axes.set(title=chart.title, ylim=(len(chart.boxes) - 0.5, -0.5))
            axes.set_yticks(range(len(chart.boxes)), [canvas.told(box.method) for box in chart.boxes])
            axes.grid(visible=False, axis="y")
        canvas.title(figure, page, data)


# ------------------------------------------------------------------------------------------------ shared
def _axis(
    axis: Any, data: Axis, *, told: bool = True, whole: bool = False, width: float | None = None
) -> None:
    """Limits, ticks and the label of an axis. whole: ticks at whole numbers alone."""
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

    if data.log:
        axis.axes.set(**{f"{axis.axis_name}scale": "log"})
        axis.set_major_locator(LogLocator(subs=(1.0,)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))
        axis.set_minor_formatter(NullFormatter())
    elif whole:
        axis.set_major_locator(MaxNLocator(integer=True))
    if data.ticks:
        axis.set_ticks([at for at, _ in data.ticks], [text for _, text in data.ticks])
        axis.set_minor_locator(NullLocator())
        axis.axes.tick_params(axis=axis.axis_name, labelrotation=45)
    axis.axes.set(**{f"{axis.axis_name}lim": (data.low, data.high)})
    if told:
        axis.set_label_text(data.label if width is None else canvas.wrapped(data.label, width))


def _finished(figure: Drawn, data: Figure, page: canvas.Page) -> None:
    canvas.title(figure, page, data)
    canvas.legend(figure, figure.axes)
