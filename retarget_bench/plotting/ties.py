"""Means with their intervals, and bars that join what the data cannot tell apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from retarget_bench.cliques import cliques, told_apart
from retarget_bench.errors import BenchError
from retarget_bench.panel import Panel
from retarget_bench.plotting import canvas, values
from retarget_bench.summary import Section, section

STEP = 0.045
"""Of the panel's width, between two bars."""


def draw(path: Path, panels: Sequence[Panel], value: str, page: canvas.Page = canvas.PAGE) -> None:
    """Draw methods from the best at the top to the worst, with 95 % intervals; bars at the right join those
    that no paired test tells apart. Below them, hollow: who is not ranked.

    Raises BenchError where no result has the value, or nobody is ranked by it.
    """
    canvas.ending(path)
    what = values.shown(panels, value)
    look = canvas.looks(values.headers(panels), page)
    found = [(panel, section(panel.narrowed(value))) for panel in panels]
    found = [(panel, each) for panel, each in found if value in each.rankings]
    if not found:
        raise BenchError(f"nobody is ranked by {value} in these results, so there are no ties to show")
    rows = [len(_rows(each, value)) for _, each in found]
    with canvas.drawn(path, page.width, sum(0.62 + 0.19 * count for count in rows)) as figure:
        grid = figure.subplots(len(found), 1, squeeze=False, height_ratios=rows).flat
        for axes, (panel, each) in zip(grid, found, strict=True):
            _means(axes, each, value, look)
            groups = cliques(told_apart(panel, each.rankings[value], value))
            _bars(axes, groups)
            ranking = each.rankings[value]
            axes.set_title(f"{each.split}: {ranking.clips} clips, {ranking.cases} common cases")
            axes.set_xlabel(what.axis)
        told = "bars join what the data cannot tell apart (lines 95 %; hollow: not ranked)"
        canvas.title(figure, page, f"{canvas.told(panels[0].dataset)}: {told}")


def _rows(section: Section, value: str) -> list[str]:
    """Labels from top to bottom: the ranked, best first, then all others that have the value."""
    order = section.rankings[value].order
    rest = [s.label for s in section.scores if s.label not in order and value in s.means]
    return [*order, *rest]


def _means(axes: Any, section: Section, value: str, look: Mapping[str, Mapping[str, Any]]) -> None:
    labels, ranked = _rows(section, value), set(section.rankings[value].order)
    for at, label in enumerate(labels):
        mean = values.mean_of(section, label, value)
        if mean is None:
            continue
        fill = {} if label in ranked else {"markerfacecolor": "white"}
        axes.plot([mean.value], [at], **{**look[label], **fill, "linestyle": "none"})
        if mean.interval is not None:
            axes.hlines(
                at, mean.interval.low, mean.interval.high, color=look[label]["color"], linewidth=1.2
            )
    axes.set_yticks(range(len(labels)), [canvas.told(label) for label in labels])
    axes.set(ylim=(len(labels) - 0.5, -0.5))
    axes.tick_params(axis="y", length=0)


def _bars(axes: Any, groups: Sequence[Sequence[int]]) -> None:
    """A bar per group at the right of the panel, with a dot for each of its members."""
    across = axes.get_yaxis_transform()
    for place, group in enumerate(groups):
        at = 1.0 + STEP * (place + 0.7)
        axes.plot([at] * len(group), group, transform=across, clip_on=False, color="0.15", linewidth=1.6,
                  marker="o", markersize=3)  # fmt: skip
