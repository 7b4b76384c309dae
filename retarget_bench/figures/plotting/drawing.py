"""Drawing the charts of a figure into a file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget_bench.figures import palette
from retarget_bench.figures.data.lines import apart
from retarget_bench.figures.data.model import (
    Axis,
    BoxChart,
    Figure,
    HeatMap,
    Line,
    LineChart,
    Mark,
    PointChart,
    RowChart,
    SkeletonChart,
)  # fmt: skip
from retarget_bench.figures.data.rows import lift
from retarget_bench.figures.plotting import canvas
from retarget_bench.figures.plotting.canvas import MarkStyles, filled

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

SHARE = 0.7
"""Of a row's height, what its marks share."""
STEP = 11.0
"""Points between two bars of ties."""
HEIGHTS = {"recall": 1.9, "denoise": 3.0, "joint-completion": 2.6, "growth": 2.3}
"""Inches of a panel of lines."""
WIDE = {"denoise": 4.2, "joint-completion": 3.0}
"""Inches that a panel is to have at least; 1.9 otherwise."""
NAMES, NAME_GAP = 0.3, 8.5
"""Share of the width that names at the ends of lines may take, and points between two of them."""
WRITTEN = 0.26
"""Inches: squares that are larger have their number written in."""
BAR = 0.9
"""Inches that a colour scale takes at the right, with its label."""
LEAST, MOST = 6.0, 70.0
"""Areas of joints, in square points, without and with the largest error."""


def draw(path: Path, data: Figure, page: canvas.Page = canvas.PAGE) -> None:
    """Draw a figure, all of whose charts are of one kind. Raises BenchError for a file of an unknown
    kind."""
    BACKENDS[type(data.charts[0])](path, data, data.charts, page)


@contextmanager
def _panels(
    path: Path,
    data: Figure,
    page: canvas.Page,
    height: float,
    charts: Sequence[Any],
    across: int,
    **options: Any,
) -> Iterator[tuple[Drawn, list[tuple[Any, Any]]]]:
    """The matplotlib figure, and each chart with its panel, row by row; None keeps a panel empty. The title
    and the legend are added when all is drawn."""
    with canvas.drawn(path, page.width, height) as figure:
        grid = figure.subplots(-(-len(charts) // across), across, squeeze=False, **options)
        for axes, chart in zip_longest(grid.flat, charts):
            axes.set_visible(chart is not None)
        panels = [each for each in zip(grid.flat, charts, strict=False) if each[1] is not None]
        yield figure, panels
        canvas.title(figure, page, data)
        if not (isinstance(charts[0], LineChart) and _named_at_ends(figure, panels, across)):
            canvas.legend(figure, figure.axes)


# ------------------------------------------------------------------------------------------------- lines
def lines(path: Path, data: Figure, charts: Sequence[LineChart], page: canvas.Page) -> None:
    """A panel per chart; a line per method with a band where all of it has intervals."""
    shown, across = _arranged(charts, page.across(WIDE.get(data.kind, 1.9)))
    styles = canvas.mark_styles(data.methods, page)
    down = len(shown) // across
    height = 0.75 * min(page.width, 4.2) if data.kind == "denoise" else HEIGHTS[data.kind] * down
    with _panels(path, data, page, 0.5 + height, shown, across) as (figure, panels):
        for axes, chart in panels:
            if chart.diagonal:
                ends = [0, min(chart.x.high, chart.y.high)]
                axes.plot(ends, ends, color="0.6", linewidth=0.8, linestyle=(0, (1, 2)), zorder=1)
            for line in chart.lines:
                _line(axes, line, styles)
            _axis(axes.xaxis, chart.x, integers=data.kind == "growth")
            _axis(axes.yaxis, chart.y)
            axes.set_title(chart.title)
            at = figure.axes.index(axes)
            over, left = at - across, at - 1 if at % across else -1
            if over >= 0 and (above := shown[over]) is not None and above.x == chart.x:
                figure.axes[over].set_xlabel("")
                figure.axes[over].tick_params(labelbottom=False)
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
        canvas.far_above(panels, styles)


def _arranged(charts: Sequence[LineChart], most: int) -> tuple[list[LineChart | None], int]:
    """Charts row by row, and the length of a row: by what their y axes show, splits side by side; where
    these have no room a row per split."""
    labels = dict.fromkeys(chart.y.label for chart in charts)
    groups = [[chart for chart in charts if chart.y.label == label] for label in labels]
    if len(groups) > 1 and len(groups[0]) > most:
        splits = dict.fromkeys(chart.split for chart in charts)
        groups = [[chart for chart in charts if chart.split == split] for split in splits]
    across = min(max(map(len, groups)), max(most, len(groups)))
    rows = [group[at : at + across] for group in groups for at in range(0, len(group), across)]
    return [chart for row in rows for chart in [*row, *[None] * (across - len(row))]], across


def _line(axes: Any, line: Line, styles: MarkStyles) -> None:
    style = dict(styles[line.method])
    if line.seen is False:
        style |= {"linestyle": "--", "markerfacecolor": "white"}
    at = [mark.at for mark in line.marks]
    axes.plot(at, [mark.mean.value for mark in line.marks], label=canvas.drawable(line.name), **style)
    if line.banded:
        spans = [mark.mean.interval for mark in line.marks if mark.mean.interval is not None]
        low, high = [span.low for span in spans], [span.high for span in spans]
        axes.fill_between(at, low, high, color=style["color"], alpha=0.12, linewidth=0)
    for mark in line.extra:
        axes.plot([mark.at], [mark.mean.value], **style | {"markerfacecolor": "white", "markersize": 6})


def _named_at_ends(figure: Drawn, panels: Sequence[tuple[Any, LineChart]], across: int) -> bool:
    """Write the names of lines at their ends in the last panel of each row; False where these have no room
    for the names of all."""
    rows: dict[int, list[tuple[Any, LineChart]]] = {}
    for axes, chart in panels:
        rows.setdefault(figure.axes.index(axes) // across, []).append((axes, chart))
    names = [{line.name for _, chart in row for line in chart.lines} for row in rows.values()]
    longest = max(len(canvas.drawable(name)) for row in names for name in row)
    if canvas.LETTER * longest > NAMES * figure.get_figwidth():
        return False
    figure.draw_without_rendering()  # gives panels their heights
    placed = []
    for (*_, (axes, chart)), labels in zip(rows.values(), names, strict=True):
        lines = [line for line in chart.lines if line.marks]
        low, high = chart.y.low, chart.y.high
        ends = [min(max(line.marks[-1].mean.value, low), high) for line in lines]
        gap = NAME_GAP / 72.0 * figure.dpi / axes.bbox.height
        heights = apart([(end - low) / (high - low) for end in ends], gap, 0.0, 1.0)
        if heights is None or labels != {line.name for line in lines}:
            return False
        placed.append((axes, lines, ends, heights))
    for axes, lines, ends, heights in placed:
        for line, end, height in zip(lines, ends, heights, strict=True):
            _end_name(axes, line, end, height)
    return True


def _end_name(axes: Any, line: Line, end: float, height: float) -> None:
    """The mark and the name of a line at the right of its panel, at a share of its height, and a stroke
    between them and the line."""
    from matplotlib.lines import Line2D
    from matplotlib.transforms import ScaledTranslation

    mark, aside = (
        axes.transAxes + ScaledTranslation(points / 72.0, 0.0, axes.figure.dpi_scale_trans)
        for points in (9.0, 14.0)
    )
    name = canvas.drawable(line.name)
    shape = Line2D([1.0], [height], transform=mark)
    shape.update_from(next(each for each in axes.lines if each.get_label() == name))
    shape.set(transform=mark, clip_on=False, linestyle="none", zorder=4)
    axes.figure.add_artist(shape)
    stroke = {"arrowstyle": "-", "color": shape.get_color(), "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0}
    axes.annotate(
        name, (line.marks[-1].at, end), (1.0, height), textcoords=aside, va="center", fontsize=7,
        arrowprops=stroke | {"relpos": (0.0, 0.5)}, annotation_clip=False,
    )  # fmt: skip


# -------------------------------------------------------------------------------------------------- rows
def rows(path: Path, data: Figure, charts: Sequence[RowChart], page: canvas.Page) -> None:
    """Rows from top to bottom, in each a mark per method with its interval; bars at the right join methods
    that the data cannot tell apart."""
    alone = charts[0].together or len(charts) == 1
    across = 1 if alone else min(len(charts), page.across(2.2))
    row = 0.19 if alone else 0.15
    heights = [
        0.62 + row * max(len(chart.rows) for chart in charts[first : first + across])
        for first in range(0, len(charts), across)
    ]
    styles = canvas.mark_styles(data.methods, page)
    with _panels(path, data, page, sum(heights) + 0.2, charts, across, height_ratios=heights) as (
        _,
        panels,
    ):
        for axes, chart in panels:
            for place, (label, marks) in enumerate(chart.marks.items()):
                shift = 0.0 if chart.together else SHARE * ((place + 0.5) / len(chart.marks) - 0.5)
                _row_marks(axes, label, marks, shift, styles, labelled=not chart.together)
            for at in range(0, len(chart.rows), 2) if not chart.together else ():
                axes.axhspan(at - 0.5, at + 0.5, color="0.5", alpha=0.08, linewidth=0)
            _row_axes(axes, chart.title, chart.axis, chart.rows, 0.6 * page.width / across)
            axes.tick_params(axis="y", length=0)
            _bars(axes, chart.joined, canvas.far_beside(axes, chart.far, styles))


def _row_marks(
    axes: Any, label: str, marks: Sequence[Mark], shift: float, styles: MarkStyles, *, labelled: bool
) -> None:
    style = {**filled(marks[0], styles), **({"label": canvas.drawable(label)} if labelled else {})}
    axes.plot([mark.mean.value for mark in marks], [mark.at + shift for mark in marks], **style)
    spans = [(mark.at + shift, mark.mean.interval) for mark in marks if mark.mean.interval is not None]
    axes.hlines(
        [at for at, _ in spans], [span.low for _, span in spans], [span.high for _, span in spans],
        color=style["color"], linewidth=0.9 if labelled else 1.2,
    )  # fmt: skip


def _row_axes(axes: Any, title: str, axis: Axis, names: Sequence[str], width: float | None = None) -> None:
    """The title, the axis below, of so many inches, and the names of rows at the left."""
    _axis(axes.xaxis, axis, width=width)
    axes.set(title=title, ylim=(len(names) - 0.5, -0.5))
    axes.set_yticks(range(len(names)), [canvas.drawable(each) for each in names])
    axes.grid(visible=False, axis="y")


def _bars(axes: Any, groups: Sequence[Sequence[int]], extent: float) -> None:
    """A bar per group at the right of the panel, with a dot for each of its members.

    extent: points at the panel's right that numbers stand on.
    """
    from matplotlib.transforms import ScaledTranslation

    for place, group in enumerate(groups):
        out = (extent + STEP * (place + 0.7)) / 72.0
        across = axes.get_yaxis_transform() + ScaledTranslation(out, 0.0, axes.figure.dpi_scale_trans)
        axes.plot([1.0] * len(group), group, transform=across, clip_on=False, color="0.15", linewidth=1.6,
                  marker="o", markersize=3)  # fmt: skip


# ------------------------------------------------------------------------------------------------ points
def points(path: Path, data: Figure, charts: Sequence[PointChart], page: canvas.Page) -> None:
    """A mark per method with its interval upwards; faint steps join those that no other beats in both."""
    across = min(len(charts), page.across(1.9))
    styles = canvas.mark_styles(data.methods, page)
    height = 0.4 + 2.1 * -(-len(charts) // across)
    with _panels(path, data, page, height, charts, across) as (_, panels):
        for at, (axes, chart) in enumerate(panels):
            for mark in chart.marks:
                style = filled(mark, styles) | {"markersize": 5.5, "label": canvas.drawable(mark.method)}
                axes.plot([mark.at], [mark.mean.value], **style, zorder=3)
                if (span := mark.mean.interval) is not None:
                    axes.vlines(mark.at, span.low, span.high, color=style["color"], linewidth=0.9)
            if len(chart.front) > 1:
                front = [(mark.at, mark.mean.value) for mark in chart.front]
                axes.step(*zip(*front, strict=True), where="pre", color="0.7", linewidth=0.8, zorder=1)
            axes.set_title(chart.title)
            _axis(axes.xaxis, chart.x)
            _axis(axes.yaxis, chart.y, labelled=at % across == 0)
        canvas.far_above(panels, styles)


# ------------------------------------------------------------------------------------------------- boxes
def boxes(path: Path, data: Figure, charts: Sequence[BoxChart], page: canvas.Page) -> None:
    """A box per method with its median, whiskers from 5 to 95 %, and a dot per clip."""
    heights = [0.62 + 0.19 * len(chart.boxes) for chart in charts]
    styles = canvas.mark_styles(data.methods, page)
    with _panels(path, data, page, sum(heights) + 0.2, charts, 1, height_ratios=heights) as (_, panels):
        for axes, chart in panels:
            for row, box in enumerate(chart.boxes):
                colour = styles[box.method]["color"]
                low, first, middle, third, high = box.quantiles
                axes.plot([low, high], [row, row], color=colour, linewidth=0.9)
                axes.barh(row, third - first, 0.6, first, color=colour, alpha=0.2)
                axes.plot([middle, middle], [row - 0.3, row + 0.3], color=colour, linewidth=1.6)
                for mark in box.marks:
                    at, number = row + lift(mark), min(mark.mean.value, chart.axis.high)
                    shape = ">" if chart.axis.beyond(mark) else "o"
                    axes.plot([number], [at], shape, color=colour, markersize=2, alpha=0.6, clip_on=False)
            _row_axes(axes, chart.title, chart.axis, [box.method for box in chart.boxes])


def _axis(
    axis: Any, data: Axis, *, labelled: bool = True, integers: bool = False, width: float | None = None
) -> None:
    """Limits, ticks and the label of an axis. integers: ticks at whole numbers alone."""
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

    if data.log:
        axis.axes.set(**{f"{axis.axis_name}scale": "log"})
        axis.set_major_locator(LogLocator(subs=(1.0,)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))
        axis.set_minor_formatter(NullFormatter())
    elif integers:
        axis.set_major_locator(MaxNLocator(integer=True))
    if data.ticks:
        axis.set_ticks([at for at, _ in data.ticks], [text for _, text in data.ticks])
        axis.set_minor_locator(NullLocator())
        axis.axes.tick_params(axis=axis.axis_name, labelrotation=45)
    axis.axes.set(**{f"{axis.axis_name}lim": (data.low, data.high)})
    if labelled:
        axis.set_label_text(data.label if width is None else canvas.wrapped(data.label, width))


# ------------------------------------------------------------------------------------------------- pairs
def maps(path: Path, data: Figure, charts: Sequence[HeatMap], page: canvas.Page) -> None:
    """A map per method, sources down, targets across; what was not asked, or not answered, is hatched."""
    first = charts[0]
    letters = 0.055 * max(map(len, map(canvas.drawable, (*first.sources, *first.targets))))
    across = max(1, min(len(charts), page.across(max(1.5, letters + 0.16 * len(first.targets)))))
    wide = (page.width - BAR - letters) / across
    side = wide / len(first.targets)
    tall = (
        0.25 + canvas.headed([chart.method for chart in charts], wide) + min(side, 0.6) * len(first.sources)
    )
    height = letters + 0.5 + -(-len(charts) // across) * tall
    with _panels(path, data, page, height, charts, across, sharex=True, sharey=True) as (figure, panels):
        grid = [*figure.axes]
        for axes, chart in panels:
            image = _map(axes, chart, written=side > WRITTEN)
            axes.set_title(canvas.heading(chart.method, wide))
        figure.colorbar(image, ax=grid, label=first.scale.label, extend="max", pad=0.02, aspect=30)


def _map(axes: Any, chart: HeatMap, *, written: bool) -> Any:
    table = np.full((len(chart.sources), len(chart.targets)), np.nan)
    for (source, target), mark in chart.squares.items():
        table[chart.sources.index(source), chart.targets.index(target)] = mark.mean.value
    axes.patch.set(hatch="////", edgecolor="0.8", facecolor="white")
    image = axes.imshow(table, cmap=canvas.errors_map(), vmin=chart.scale.low, vmax=chart.scale.high)
    axes.set_xticks(range(len(chart.targets)), map(canvas.drawable, chart.targets), rotation=90)
    axes.set_yticks(range(len(chart.sources)), map(canvas.drawable, chart.sources))
    axes.tick_params(length=0)
    axes.grid(visible=False)
    for (line, column), number in np.ndenumerate(table):
        if written and not np.isnan(number):
            ink = palette.ink(palette.shades()[palette.shade(chart.scale.share(number))])
            axes.text(column, line, canvas.short(number), ha="center", va="center", fontsize=6, color=ink)
    return image


# ------------------------------------------------------------------------------------------------ joints
def skeletons(path: Path, data: Figure, charts: Sequence[SkeletonChart], page: canvas.Page) -> None:
    """A skeleton per method, its joints larger and darker the farther off they are."""
    across = min(len(charts), page.across(1.25))
    down = -(-len(charts) // across)
    wide, tall = np.ptp(np.array(charts[0].places), axis=0)
    panel = (page.width - BAR) / across
    height = panel * min(2.2, max(0.6, float(tall / max(wide, 1e-6))))
    height += 0.2 + canvas.headed([chart.method for chart in charts], panel)
    with _panels(path, data, page, 0.4 + down * height, charts, across) as (figure, panels):
        grid = [*figure.axes]
        for axes, chart in panels:
            dots = _skeleton(axes, chart)
            axes.set_title(canvas.heading(chart.method, panel))
            axes.set_axis_off()
        figure.colorbar(dots, ax=grid, label=charts[0].scale.label, extend="max", pad=0.02, aspect=30)


def _skeleton(axes: Any, chart: SkeletonChart) -> Any:
    """Bones, and a dot per joint that has a number; what is drawn last, the worst, lies on top."""
    from matplotlib.collections import LineCollection

    places = np.array(chart.places)
    axes.add_collection(
        LineCollection([places[list(bone)] for bone in chart.bones], colors="0.6", linewidths=1.5, zorder=1)
    )
    shares = np.array([chart.scale.share(mark.mean.value) for mark in chart.marks])
    dots = axes.scatter(
        *places[[int(mark.at) for mark in chart.marks]].T, s=LEAST + (MOST - LEAST) * shares,
        c=[mark.mean.value for mark in chart.marks], cmap=canvas.errors_map(), vmin=chart.scale.low,
        vmax=chart.scale.high, edgecolors="0.2", linewidths=0.5, zorder=2,
    )  # fmt: skip
    axes.set_aspect("equal")
    axes.margins(0.08)
    return dots


BACKENDS: dict[type, Callable[[Path, Figure, Any, canvas.Page], None]] = {
    LineChart: lines,
    RowChart: rows,
    PointChart: points,
    BoxChart: boxes,
    HeatMap: maps,
    SkeletonChart: skeletons,
}
