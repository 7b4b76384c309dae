"""Means with their intervals, and bars that join what the data cannot tell apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from retarget_bench.analysis.summary import SplitSummary, split_summary
from retarget_bench.analysis.tie_groups import separated, tie_groups
from retarget_bench.errors import BenchError
from retarget_bench.figures.plotting import canvas, edges, values
from retarget_bench.results.result_matrix import ResultMatrix

STEP = 11.0
"""Points between two bars."""


def draw(path: Path, panels: Sequence[ResultMatrix], value: str, page: canvas.Page = canvas.PAGE) -> None:
    """Draw methods from the best at the top to the worst, with 95 % intervals; bars at the right join those
    that no paired test tells apart. Below them, hollow: who is not ranked.

    Raises BenchError where no result has the value, or nobody is ranked by it.
    """
    canvas.ending(path)
    what = values.shown(panels, value)
    headers = values.headers(panels)
    look = canvas.looks(headers, page)
    found = [(panel, split_summary(panel.narrowed(value))) for panel in panels]
    found = [(panel, each) for panel, each in found if value in each.rankings]
    if not found:
        raise BenchError(f"nobody is ranked by {value} in these results, so there are no ties to show")
    rows = [len(_rows(each, value)) for _, each in found]
    far: list[edges.Edge] = []
    with canvas.drawn(path, page.width, sum(0.62 + 0.19 * count for count in rows)) as figure:
        grid = figure.subplots(len(found), 1, squeeze=False, height_ratios=rows).flat
        for axes, (panel, each) in zip(grid, found, strict=True):
            means = {s.label: [s.means[value]] for s in each.scores if value in s.means}
            edge = edges.edge(means, headers, what.declared)
            _means(axes, each, value, look, edge)
            groups = tie_groups(separated(panel, each.rankings[value], value))
            _bars(axes, groups, edges.beside(axes, edge))
            far.append(edge)
            ranking = each.rankings[value]
            axes.set_title(f"{each.split}: {ranking.clips} clips, {ranking.cases} common cases")
            axes.set_xlabel(what.axis)
        told = "bars join what the data cannot tell apart (lines 95 %; hollow: not ranked"
        canvas.title(figure, page, f"{canvas.told(panels[0].dataset)}: {told}{edges.told(far)})")


def _rows(section: SplitSummary, value: str) -> list[str]:
    """Labels from top to bottom: the ranked, best first, then all others that have the value."""
    order = section.rankings[value].order
    rest = [s.label for s in section.scores if s.label not in order and value in s.means]
    return [*order, *rest]


def _means(
    axes: Any, section: SplitSummary, value: str, look: Mapping[str, Mapping[str, Any]], edge: edges.Edge
) -> None:
    labels, ranked = _rows(section, value), set(section.rankings[value].order)
    for at, label in enumerate(labels):
        mean = values.mean_of(section, label, value)
        if mean is None:
            continue
        fill = {} if label in ranked else {"markerfacecolor": "white"}
        marks = {**look[label], **fill, "linestyle": "none"}
        axes.plot([mean.value], [at], **marks)
        edge.keep(at, mean, marks)
        if mean.interval is not None:
            axes.hlines(
                at, mean.interval.low, mean.interval.high, color=look[label]["color"], linewidth=1.2
            )
    axes.set_yticks(range(len(labels)), [canvas.told(label) for label in labels])
    axes.set(ylim=(len(labels) - 0.5, -0.5), xlim=edge.ends)
    axes.tick_params(axis="y", length=0)


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
