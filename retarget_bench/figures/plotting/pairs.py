"""Errors by source and target: a heat map per method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.analysis.breakdown import UNKNOWN
from retarget_bench.analysis.statistics import per_clip
from retarget_bench.figures.plotting import canvas, values
from retarget_bench.results import case_metadata
from retarget_bench.results.result_matrix import ResultMatrix

COLOURS = "YlOrRd"
"""From light to dark, so that it says the same in grey."""
MOST = 14
"""Bodies on a side; where there are more, they are taken together by structure."""
WRITTEN = 0.26
"""Inches: squares that are larger have their number written in."""
HIGHEST = 0.98
"""The share of all squares that the colours are spread over; the few beyond have the darkest."""


def draw(path: Path, panels: Sequence[ResultMatrix], value: str, page: canvas.Page = canvas.PAGE) -> None:
    """Draw the mean of every pair, sources down, targets across; all splits in one map, one scale for all.

    Bodies are taken together by structure where there are more than ``MOST``. What nobody asked, or the
    method did not answer, is hatched. Raises BenchError where no result has the value.
    """
    canvas.ending(path)
    what = values.shown(panels, value)
    names = _names(panels)
    found = {label: means(panels, label, value, names) for label in values.headers(panels)}
    found = {label: each for label, each in found.items() if each}
    sources, targets = (sorted({pair[side] for each in found.values() for pair in each}) for side in (0, 1))
    letters = 0.055 * max(map(len, map(canvas.told, (*sources, *targets))))
    across = max(1, min(len(found), page.across(max(1.5, letters + 0.16 * len(targets)))))
    side = (page.width - 0.7 - letters) / across / len(targets)
    down = -(-len(found) // across)
    known = np.array([mean for each in found.values() for mean in each.values()])
    with canvas.drawn(
        path, page.width, letters + 0.5 + down * (0.3 + min(side, 0.6) * len(sources))
    ) as figure:
        grid = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True)
        limits = float(min(known.min(), 0.0)), float(np.quantile(known, HIGHEST))
        for axes, (label, each) in zip(grid.flat, found.items(), strict=False):
            _map(axes, each, sources, targets, limits, written=side > WRITTEN)
            axes.set_title(canvas.told(label))
        for axes in grid.flat[len(found) :]:
            axes.set_visible(False)
        image = grid.flat[0].get_images()[0]
        figure.colorbar(image, ax=grid, label=what.axis, extend="max", pad=0.02, aspect=30)
        canvas.title(figure, page, f"{canvas.told(panels[0].dataset)}: sources down, targets across")


def means(
    panels: Sequence[ResultMatrix], label: str, value: str, names: Mapping[str, str]
) -> dict[tuple[str, str], float]:
    """(source, target) -> the mean over clips of the mean over a clip's cases, of one method.

    names: body -> what it is called in the picture; pairs of one name each are taken together.
    """
    numbers: dict[tuple[str, str], list[np.ndarray]] = {}
    for panel in panels:
        rows = [row.label for row in panel.rows]
        if label not in rows:
            continue
        row = panel.numbers((value, ""))[rows.index(label)]
        pairs = [(names[info.source], names[info.target]) for info in panel.cases]
        for pair in sorted(set(pairs)):
            here = np.array([each == pair for each in pairs]) & panel.own & ~np.isnan(row)
            if here.any():
                clips = np.unique(panel.clips[here], return_inverse=True)[1]
                numbers.setdefault(pair, []).append(per_clip(row[here], clips))
    return {pair: float(np.concatenate(each).mean()) for pair, each in numbers.items()}


def _names(panels: Sequence[ResultMatrix]) -> dict[str, str]:
    """Body -> what it is called: itself, or its structure where there are too many bodies."""
    bodies = {name for panel in panels for info in panel.cases for name in (info.source, info.target)}
    if len(bodies) <= MOST:
        return {name: name for name in bodies}
    structures: dict[str, str] = {}
    for panel in panels:
        for row in panel.rows:
            structures |= case_metadata.read_structures(row.place) or {}
    return {name: structures.get(name, UNKNOWN) for name in bodies}


def _map(
    axes: Any,
    found: Mapping[tuple[str, str], float],
    sources: Sequence[str],
    targets: Sequence[str],
    limits: tuple[float, float],
    *,
    written: bool,
) -> None:
    table = np.array([[found.get((source, target), np.nan) for target in targets] for source in sources])
    axes.patch.set(hatch="////", edgecolor="0.8", facecolor="white")
    axes.imshow(table, cmap=COLOURS, vmin=limits[0], vmax=limits[1])
    axes.set_xticks(range(len(targets)), [canvas.told(each) for each in targets], rotation=90)
    axes.set_yticks(range(len(sources)), [canvas.told(each) for each in sources])
    axes.tick_params(length=0)
    axes.grid(visible=False)
    middle = limits[0] + 0.6 * (limits[1] - limits[0])
    for (line, column), number in np.ndenumerate(table):
        if written and not np.isnan(number):
            ink = "white" if number > middle else "0.1"
            axes.text(column, line, canvas.short(number), ha="center", va="center", fontsize=6, color=ink)
