"""Error over the seconds of a clip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from retarget_bench.analysis.summary import Mean, SplitSummary, split_summary
from retarget_bench.figures.plotting import canvas, edges, values
from retarget_bench.figures.plotting.levels import banded
from retarget_bench.results.result_matrix import ResultMatrix


def draw(path: Path, panels: Sequence[ResultMatrix], value: str, page: canvas.Page = canvas.PAGE) -> None:
    """Draw a line per method with its 95 % interval, a panel per split.

    Later seconds are those of longer clips alone. Raises BenchError where no result has the curve.
    """
    canvas.ending(path)
    what = values.shown(panels, value, "second")
    headers = values.headers(panels)
    look = canvas.looks(headers, page)
    sections = [split_summary(panel.narrowed(value)) for panel in panels if value in panel.values]
    edge = edges.edge(_all(sections, value), headers, what.declared, bands=True)
    found = [replace(edge, far=[]) for _ in sections]
    across = min(len(sections), page.across(1.9))
    down = -(-len(sections) // across)
    from matplotlib.ticker import MaxNLocator

    with canvas.drawn(path, page.width, 0.4 + 2.3 * down) as figure:
        grid = figure.subplots(down, across, squeeze=False, sharey=True)
        for axes, each, edge in zip(grid.flat, sections, found, strict=False):
            for score in each.scores:
                curve = score.curves.get(value, {})
                points = sorted((float(second), mean) for second, mean in curve.items())
                banded(axes, canvas.told(score.label), points, look[score.label], edge)
            axes.set(title=f"{each.split}: {each.clips} clips", xlabel="end of the second, s")
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        grid[0, 0].set_ylim(*(edge.ends or (0, None)))
        edges.above(grid.flat, found)
        for axes in grid[:, 0]:
            axes.set_ylabel(what.axis)
        for axes in grid.flat[len(sections) :]:
            axes.set_visible(False)
        what_of = f"{canvas.told(panels[0].dataset)}: error over time, bands 95 %"
        canvas.title(figure, page, what_of + edges.told(found))
        canvas.legend(figure, list(grid.flat))


def _all(sections: Sequence[SplitSummary], value: str) -> dict[str, list[Mean]]:
    """Label -> the means of its curves, of all splits, which share an axis."""
    found: dict[str, list[Mean]] = {}
    for each in sections:
        for score in each.scores:
            found.setdefault(score.label, []).extend(score.curves.get(value, {}).values())
    return found
