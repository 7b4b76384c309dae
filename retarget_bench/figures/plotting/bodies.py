"""Heat maps of pairs, and skeletons with the errors of their joints."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.figures import palette
from retarget_bench.figures.data.model import Figure, HeatMap, SkeletonChart
from retarget_bench.figures.plotting import canvas

WRITTEN = 0.26
"""Inches: squares that are larger have their number written in."""
LEAST, MOST = 6.0, 70.0
"""Areas of joints, in square points, without and with the largest error."""


def maps(path: Path, data: Figure, page: canvas.Page) -> None:
    """A map per method, sources down, targets across; what was not asked, or not answered, is hatched."""
    charts = [chart for chart in data.charts if isinstance(chart, HeatMap)]
    first = charts[0]
    letters = 0.055 * max(map(len, map(canvas.told, (*first.sources, *first.targets))))
    across = max(1, min(len(charts), page.across(max(1.5, letters + 0.16 * len(first.targets)))))
    side = (page.width - 0.7 - letters) / across / len(first.targets)
    down = -(-len(charts) // across)
    height = letters + 0.5 + down * (0.3 + min(side, 0.6) * len(first.sources))
    with canvas.drawn(path, page.width, height) as figure:
        grid = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True)
        for axes, chart in zip(grid.flat, charts, strict=False):
            _map(axes, chart, written=side > WRITTEN)
        for axes in grid.flat[len(charts) :]:
            axes.set_visible(False)
        image = grid.flat[0].get_images()[0]
        figure.colorbar(image, ax=grid, label=first.scale.label, extend="max", pad=0.02, aspect=30)
        canvas.title(figure, page, data)


def _map(axes: Any, chart: HeatMap, *, written: bool) -> None:
    table = np.full((len(chart.sources), len(chart.targets)), np.nan)
    for (source, target), mark in chart.squares.items():
        table[chart.sources.index(source), chart.targets.index(target)] = mark.mean.value
    axes.patch.set(hatch="////", edgecolor="0.8", facecolor="white")
    axes.imshow(table, cmap=canvas.errors_map(), vmin=chart.scale.low, vmax=chart.scale.high)
    axes.set_xticks(range(len(chart.targets)), [canvas.told(each) for each in chart.targets], rotation=90)
    axes.set_yticks(range(len(chart.sources)), [canvas.told(each) for each in chart.sources])
    axes.set_title(canvas.told(chart.method))
    axes.tick_params(length=0)
    axes.grid(visible=False)
    for (line, column), number in np.ndenumerate(table):
        if written and not np.isnan(number):
            ink = palette.ink(palette.shades()[palette.shade(chart.scale.share(number))])
            axes.text(column, line, canvas.short(number), ha="center", va="center", fontsize=6, color=ink)


def skeletons(path: Path, data: Figure, page: canvas.Page) -> None:
    """A skeleton per method, its joints larger and darker the farther off they are."""
    charts = [chart for chart in data.charts if isinstance(chart, SkeletonChart)]
    across = min(len(charts), page.across(1.25))
    down = math.ceil(len(charts) / across)
    wide, tall = np.ptp(np.array(charts[0].places), axis=0)
    height = (page.width - 0.8) / across * min(2.2, max(0.6, float(tall / max(wide, 1e-6))))
    with canvas.drawn(path, page.width, 0.4 + down * (height + 0.2)) as figure:
        grid = figure.subplots(down, across, squeeze=False)
        for axes, chart in zip(grid.flat, charts, strict=False):
            dots = _skeleton(axes, chart)
            axes.set_title(canvas.told(chart.method))
        for axes in grid.flat:
            axes.set_axis_off()
        figure.colorbar(dots, ax=grid, label=charts[0].scale.label, extend="max", pad=0.02, aspect=30)
        canvas.title(figure, page, data)


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
