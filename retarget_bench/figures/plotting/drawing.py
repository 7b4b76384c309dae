"""A chart in its panel, the same in files and on pages, and the panels of a file.

Artists of a series have a gid, ``NUMBER-GROUP``, by which ``page_svg`` finds them: its number in the chart
and what it is, ``line``, ``box`` or a group of marks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget_bench.figures import palette
from retarget_bench.figures.data import values
from retarget_bench.figures.data.model import BEYOND, Axis, Chart, Figure, Mark, Series, SkeletonChart
from retarget_bench.figures.palette import MethodStyle
from retarget_bench.figures.plotting import canvas

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

MARKS = "osD^vPX*"
DASHES: dict[str, Any] = {
    "full": "-", "dashed": "--", "dotted": ":", "dash-dot": "-.", "long": (0, (10, 3)),
}  # fmt: skip
ARROWHEADS = {(True, "above"): ">", (True, "below"): "<", (False, "above"): "^", (False, "below"): "v"}
"""Whether places are rows, and the group of marks -> its shape."""
SIZES = {"marks": 3.5, "extra": 6.0, "above": 4.5, "below": 4.5}
"""Points, of marks by their group."""
DOT, TICKS = 2.2, 5
"""Points of a clip's mark, and most ticks of an axis."""
LEAST, MOST = 2.4, 8.5
"""Points: joints without and with the largest error."""
EDGE, NAME = 0.1, 0.3
"""Inches around a body, and above it for its method's name."""
PANEL, AROUND = 2.2, 0.62
"""Inches that a panel is wide at least, and what its title and axes take of its height."""
ROW, LINES, TALL = 0.19, 1.75, 2.3
"""Inches: of a row, of lines, and of lines over two axes alike."""
LANE, BESIDE = 0.17, 6.0
"""Share of a row that each of many marks takes, and points that whiskers of lines are spread over."""
WORDS, NAMES = 0.72, 0.36
"""Shares of a panel's width that words above and below it may take, and names of rows."""


def body(chart: Chart) -> float:
    """The inches that a chart is high, without its title and axes."""
    if not chart.rows:
        return TALL if chart.above else LINES
    lanes = 1.0 if chart.named else max(1.0, LANE * len(chart.series))
    return ROW * lanes * len(chart.at.ticks)


def row_name(text: str, width: float) -> str:
    """The name of a row in a panel of so many inches."""
    return canvas.shortened(text, max(8, int(NAMES * width / canvas.LETTER)))


def panel(axes: Any, chart: Chart, styles: Mapping[str, MethodStyle], width: float) -> None:
    """Draw a chart. width: the inches of its panel, with names and labels."""
    if chart.guide:
        corners = zip(*chart.guide, strict=True)
        axes.plot(*_put(chart, *corners), color="0.6", linewidth=0.8, linestyle=(0, (1, 2)), zorder=1)
    for number, series in enumerate(chart.series):
        _series(axes, chart, series, styles[series.method], number)
    y = chart.y
    if chart.rows:
        y = replace(y, ticks=tuple((at, row_name(text, width)) for at, text in y.ticks))
    _axis(axes.xaxis, chart.x, WORDS * width)
    _axis(axes.yaxis, y, body(chart))
    if chart.rows:
        axes.invert_yaxis()
        axes.grid(visible=False, axis="y")
        for at in range(0, len(chart.at.ticks), 2) if not chart.named else ():
            axes.axhspan(at - 0.5, at + 0.5, color="0.5", alpha=0.08, linewidth=0)
    fixed = {} if chart.above else {"y": 1.0}  # else its place is sought, which takes long
    axes.set_title(canvas.wrapped(canvas.drawable(chart.title), WORDS * width), **fixed)
    if len(chart.tied) > 1:
        bar = {"color": "0.15", "linewidth": 1.6, "marker": "o", "markersize": 3, "clip_on": False}
        axes.plot([1.03] * len(chart.tied), chart.tied, transform=axes.get_yaxis_transform(), **bar)
    if chart.above is not None:
        label, ticks = chart.above
        top = axes.secondary_xaxis("top")
        top.set_xticks([at for at, _ in ticks], [text for _, text in ticks])
        top.set_xlabel(canvas.wrapped(label, WORDS * width))


def _put(chart: Chart, places: Sequence[float], numbers: Sequence[float]) -> tuple[Any, Any]:
    return (numbers, places) if chart.rows else (places, numbers)


def _series(axes: Any, chart: Chart, series: Series, style: MethodStyle, number: int) -> None:
    """A line with its marks, their intervals as whiskers, those of several lines beside each other; a box;
    and arrowheads at the edge."""
    from matplotlib.transforms import ScaledTranslation

    def draw(group: str, places: Sequence[float], numbers: Sequence[float], **more: Any) -> None:
        axes.plot(*_put(chart, places, numbers), gid=f"{number}-{group}", color=style.colour, **more)

    if series.box is not None:
        row, (low, first, middle, third, high) = series.box
        draw("box", [row, row], [low, high], linewidth=0.9)
        draw("box", [row, row], [first, third], linewidth=8, alpha=0.25, solid_capstyle="butt")
        draw("box", [row - 0.32, row + 0.32], [middle, middle], linewidth=1.8, solid_capstyle="butt")
    if chart.joined:
        line = "--" if series.unseen else DASHES[style.dash]
        at, numbers = [mark.at for mark in series.marks], [mark.mean.value for mark in series.marks]
        draw("line", at, numbers, linestyle=line, linewidth=1.2, label=canvas.drawable(series.title))
    spans = [(mark.at, mark.mean.interval) for mark in series.marks if mark.mean.interval is not None]
    if spans:
        gap = float("nan")
        ends = [end for _, span in spans for end in (span.low, span.high, gap)]
        at = [place for each, _ in spans for place in (each, each, gap)]
        across = BESIDE * ((number + 0.5) / len(chart.series) - 0.5) if chart.joined else 0.0
        beside = ScaledTranslation(across / 72.0, 0.0, axes.figure.dpi_scale_trans)
        more = {"solid_capstyle": "butt", "transform": axes.transData + beside}
        draw("line", at, ends, linewidth=0.8, alpha=0.7, **more)
    for group, marks in series.groups(chart.value).items():
        look = _look(series, style, SIZES[group]) | {"linestyle": "none", "clip_on": False, "zorder": 3}
        if series.box is not None:
            look |= {"marker": "o", "markersize": DOT, "alpha": 0.7}
        if group in BEYOND:
            look |= {"marker": ARROWHEADS[chart.rows, group], "markersize": SIZES[group]}
        numbers = np.clip([mark.mean.value for mark in marks], chart.value.low, chart.value.high).tolist()
        draw(group, [mark.at for mark in marks], numbers, **look)


def _look(series: Series, style: MethodStyle, size: float) -> dict[str, Any]:
    """How the marks of a series look."""
    face = "white" if series.unranked else style.colour
    shape = {"marker": MARKS[style.shape], "markersize": size}
    return {**shape, "markerfacecolor": face, "markeredgewidth": 0.7}


def sample(series: Series, style: MethodStyle, *, joined: bool) -> Any:
    """A line and a mark of a series, for legends."""
    from matplotlib.lines import Line2D

    line: Any = ("--" if series.unseen else DASHES[style.dash]) if joined else "none"
    look = _look(series, style, SIZES["marks"])
    return Line2D([], [], color=style.colour, linestyle=line, linewidth=1.2, **look)


def _axis(axis: Any, data: Axis, width: float) -> None:
    """Limits, ticks and the label of an axis, which takes so many inches."""
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

    if data.log:
        axis.axes.set(**{f"{axis.axis_name}scale": "log"})
        axis.set_major_locator(LogLocator(subs=(1.0,) if data.high > 50 * data.low else (1.0, 2.0, 5.0)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))
    else:
        axis.set_major_locator(MaxNLocator(TICKS, steps=[1, 2, 2.5, 5, 10]))
    if data.ticks:
        axis.set_ticks([at for at, _ in data.ticks], [text for _, text in data.ticks])
        if data.log:
            axis.axes.tick_params(axis=axis.axis_name, labelrotation=45)
    axis.axes.set(**{f"{axis.axis_name}lim": (data.low, data.high)})
    axis.set_label_text(canvas.wrapped(data.label, width))


# -------------------------------------------------------------------------------------------------- files
def draw(
    path: Path,
    data: Figure,
    styles: Mapping[str, MethodStyle],
    width: float = canvas.WIDTHS["page"],
    *,
    titled: bool = True,
) -> None:
    """Draw the charts of a figure side by side, of the methods that are shown without being asked for.

    width: inches. titled: whether a title stands above them, like a caption. Raises BenchError for a file
    of an unknown kind.
    """
    labels = values.shown((each.method for chart in data.charts for each in chart.series), styles)
    charts = [
        replace(chart, series=tuple(each for each in chart.series if each.method in labels))
        for chart in data.charts
    ]
    across = _across(charts, width)
    rows = [charts[at : at + across] for at in range(0, len(charts), across)]
    heights = [AROUND + max(map(body, row)) for row in rows]
    with canvas.drawn(path, width, sum(heights) + 0.2) as figure:
        grid = figure.subplots(len(rows), across, squeeze=False, height_ratios=heights)
        for axes in grid.flat[len(charts) :]:
            axes.set_visible(False)
        for axes, chart in zip(grid.flat, charts, strict=False):
            panel(axes, chart, styles, width / across)
        if titled:
            _title(figure, replace(data, charts=tuple(charts)), width)
        _legend(figure, charts, styles)


def _across(charts: list[Chart], width: float) -> int:
    """How many panels stand in a row: as many as there is room for of those that show the same value, and
    all rows full."""
    alike = sum(chart.value.label == charts[0].value.label for chart in charts)
    least = width if charts[0].named else PANEL
    return max(n for n in range(1, max(1, int(width / least)) + 1) if alike % n == 0)


def _title(figure: Drawn, data: Figure, width: float) -> None:
    """The title, with what has to be known to read the charts."""
    notes = "; ".join([*data.notes, *canvas.notes(data.charts)])
    text = f"{canvas.drawable(data.dataset)}: {canvas.drawable(data.title)}"
    figure.suptitle(canvas.wrapped(f"{text} ({notes})" if notes else text, width))


def _legend(figure: Drawn, charts: list[Chart], styles: Mapping[str, MethodStyle]) -> None:
    """One legend for all panels, below them; the figure grows by its height. None where rows name all."""
    named = {
        each.title: sample(each, styles[each.method], joined=chart.joined)
        for chart in charts
        if not chart.named
        for each in chart.series
    }
    if not named:
        return
    width = figure.get_figwidth()
    most = max(2.4, 0.5 * width) - canvas.HANDLE
    names = [canvas.wrapped(canvas.drawable(title), most) for title in named]
    longest = max(len(line) for name in names for line in name.splitlines())
    columns = min(len(names), max(1, int(width / (canvas.HANDLE + canvas.LETTER * longest))))
    lines = math.ceil(len(names) / columns) * max(name.count("\n") + 1 for name in names)
    figure.set_figheight(figure.get_figheight() + canvas.LINE * lines + 0.1)
    figure.legend(list(named.values()), names, loc="outside lower center", frameon=False,
                  ncols=columns, handlelength=2.6)  # fmt: skip


# -------------------------------------------------------------------------------------------- skeletons
def skeleton(figure: Any, chart: SkeletonChart) -> dict[str, tuple[Mark, ...]]:
    """Draw bones, and a dot per joint that has a number, the worst on top. Returns the gids of the dots and
    their marks."""
    from matplotlib.lines import Line2D

    def draw(at: np.ndarray, **look: Any) -> None:
        figure.add_artist(Line2D(*at.T, transform=figure.dpi_scale_trans, **look))

    places, bones = _fitted(chart, *figure.get_size_inches()), np.array(chart.bones, dtype=int)
    ends = np.full((len(bones), 3, 2), np.nan)
    ends[:, :2] = places[bones.reshape(-1, 2)]
    draw(ends.reshape(-1, 2), color="0.65", linewidth=1.5, zorder=1)
    drawn: dict[int, list[Mark]] = {}
    for mark in chart.marks:
        drawn.setdefault(palette.shade(mark.mean.value / chart.errors.high), []).append(mark)
    for shade, marks in drawn.items():
        draw(
            places[[int(mark.at) for mark in marks]], gid=f"0-{shade}", zorder=2 + shade, linestyle="none",
            marker="o", markersize=LEAST + (MOST - LEAST) * shade / (palette.SHADES - 1),
            markerfacecolor=palette.shades()[shade], markeredgecolor="0.2", markeredgewidth=0.5,
        )  # fmt: skip
    most = int(figure.get_figwidth() / canvas.LETTER)
    names = chart.method.replace("[", "\n[", 1).splitlines() if len(chart.method) > most else [chart.method]
    name = "\n".join(canvas.shortened(each, most) for each in names)
    figure.text(0.5, 0.98, name, ha="center", va="top")
    return {f"0-{shade}": tuple(marks) for shade, marks in drawn.items()}


def _fitted(chart: SkeletonChart, width: float, height: float) -> np.ndarray:
    """``(joints, 2)`` inches: the body in a picture of this size, below two lines of a name."""
    places = np.array(chart.places)
    low, high = places.min(axis=0), places.max(axis=0)
    room = np.array([width - 2 * EDGE, height - 2 * EDGE - NAME])
    scale = float((room / np.maximum(high - low, 1e-6)).min())
    return np.asarray((places - 0.5 * (low + high)) * scale + EDGE + 0.5 * room)
