"""Error by kind of performance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import median

import numpy as np

from retarget_bench.analysis.breakdown import breakdown
from retarget_bench.analysis.statistics import losses
from retarget_bench.analysis.summary import Mean, split_summary
from retarget_bench.figures.plotting import canvas, edges, values
from retarget_bench.figures.plotting.dots import dots
from retarget_bench.results.result_matrix import ResultMatrix

ROW = 0.15
"""Inches."""


def draw(path: Path, panels: Sequence[ResultMatrix], value: str, page: canvas.Page = canvas.PAGE) -> None:
    """Draw a row per kind and a mark per method with its 95 % interval; a panel per split.

    Kinds stand in the order of the median method's error, the farthest off at the top. Raises BenchError
    where no result has the value.
    """
    canvas.ending(path)
    what = values.shown(panels, value)
    headers = values.headers(panels)
    look = canvas.looks(headers, page)
    found = [(panel.split, by_kind(panel, value)) for panel in panels if value in panel.values]
    across = min(len(found), page.across(2.2))
    rows = [found[first : first + across] for first in range(0, len(found), across)]
    heights = [0.6 + ROW * max(len(kinds) for _, kinds in row) for row in rows]
    far: list[edges.Edge] = []
    with canvas.drawn(path, page.width, sum(heights) + 0.2) as figure:
        grid = figure.subplots(len(rows), across, squeeze=False, height_ratios=heights)
        for axes, (split, kinds) in zip(grid.flat, found, strict=False):
            labels = {label: look[label] for each in kinds.values() for label in each}
            means = {label: [each.get(label) for each in kinds.values()] for label in labels}
            edge = edges.edge({k: filter(None, row) for k, row in means.items()}, headers, what.declared)
            far.append(edge)
            dots(axes, list(kinds), means, look, edge)
            axes.set(title=split, xlabel=canvas.wrapped(what.axis, 0.6 * page.width / across))
        for axes in grid.flat[len(found) :]:
            axes.set_visible(False)
        what_of = f"{canvas.told(panels[0].dataset)}: by kind of performance, bars 95 %"
        canvas.title(figure, page, what_of + edges.told(far))
        canvas.legend(figure, list(grid.flat))


def by_kind(panel: ResultMatrix, value: str) -> dict[str, dict[str, Mean]]:
    """Kind -> label -> mean, of the kinds that any method has; the hardest first."""
    parts = [split_summary(part) for part in breakdown(panel.narrowed(value), "kind")]
    found = {
        part.part: {score.label: score.means[value] for score in part.scores if value in score.means}
        for part in parts
    }
    hard = {kind: median(mean.value for mean in each.values()) for kind, each in found.items() if each}
    declared = panel.values[value]
    worse = losses(np.array(list(hard.values())), declared.better, declared.goal).tolist()
    order = dict(zip(hard, worse, strict=True))
    return {kind: found[kind] for kind in sorted(hard, key=lambda kind: -order[kind])}
