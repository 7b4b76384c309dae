"""Error over the seconds of a clip."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from retarget_bench.panel import Panel
from retarget_bench.plotting import canvas, values
from retarget_bench.plotting.levels import banded
from retarget_bench.summary import section


def draw(path: Path, panels: Sequence[Panel], value: str, page: canvas.Page = canvas.PAGE) -> None:
    """Draw a line per method with its 95 % interval, a panel per split.

    Later seconds are those of longer clips alone. Raises BenchError where no result has the curve.
    """
    canvas.ending(path)
    what = values.shown(panels, value, "second")
    look = canvas.looks(values.headers(panels), page)
    sections = [section(panel.narrowed(value)) for panel in panels if value in panel.values]
    across = min(len(sections), page.across(1.9))
    down = -(-len(sections) // across)
    from matplotlib.ticker import MaxNLocator

    with canvas.drawn(path, page.width, 0.4 + 2.3 * down) as figure:
        grid = figure.subplots(down, across, squeeze=False, sharey=True)
        for axes, each in zip(grid.flat, sections, strict=False):
            for score in each.scores:
                curve = score.curves.get(value, {})
                points = sorted((float(second), mean) for second, mean in curve.items())
                banded(axes, canvas.told(score.label), points, look[score.label])
            axes.set(title=f"{each.split}: {each.clips} clips", xlabel="end of the second, s")
            axes.set_ylim(bottom=0)
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        for axes in grid[:, 0]:
            axes.set_ylabel(what.axis)
        for axes in grid.flat[len(sections) :]:
            axes.set_visible(False)
        canvas.title(figure, page, f"{canvas.told(panels[0].dataset)}: error over time, bands 95 %")
        canvas.legend(figure, list(grid.flat))
