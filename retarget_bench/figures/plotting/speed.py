"""How good methods are against how fast they are."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.summary import split_summary
from retarget_bench.errors import BenchError
from retarget_bench.figures.plotting import canvas, edges, values
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.result_matrix import ResultMatrix

if TYPE_CHECKING:
    from retarget_bench.analysis.summary import MethodSummary


def draw(path: Path, panels: Sequence[ResultMatrix], value: str, page: canvas.Page = canvas.PAGE) -> None:
    """Draw a mark per method, a panel per split: speed to the right, the value upwards with its interval.

    Faint steps join the ranked ones that no other ranked one beats in both. Raises BenchError where no
    method has both.
    """
    canvas.ending(path)
    what = values.shown(panels, value)
    headers = values.headers(panels)
    look = canvas.looks(headers, page)
    sections = [split_summary(panel.narrowed(value)) for panel in panels]
    timed = [[score for score in each.scores if score.fps and value in score.means] for each in sections]
    if not any(timed):
        raise BenchError(
            f"no method of these results has {value} and a speed; bench run measures speed; predictions "
            "made elsewhere have none"
        )
    shown = [(each, scores) for each, scores in zip(sections, timed, strict=True) if scores]
    across = min(len(shown), page.across(1.9))
    down = -(-len(shown) // across)
    found: list[edges.Edge] = []
    with canvas.drawn(path, page.width, 0.4 + 2.1 * down) as figure:
        grid = figure.subplots(down, across, squeeze=False, sharex=True)
        for axes, (each, scores) in zip(grid.flat, shown, strict=False):
            edge = edges.edge({s.label: [s.means[value]] for s in scores}, headers, what.declared)
            found.append(edge)
            _marks(axes, scores, value, look, edge)
            ranked = [(s.fps or 0.0, s.means[value].value) for s in scores if not s.unranked]
            _front(axes, ranked, what.declared)
            axes.set(title=f"{each.split}: {each.clips} clips", xlabel="frames per second, one thread")
            canvas.spaced_by_ratio(axes.xaxis, decades=True)
            axes.set_ylim(edge.ends)
        edges.above(grid.flat, found)
        for axes in grid[:, 0]:
            axes.set_ylabel(what.axis)
        for axes in grid.flat[len(shown) :]:
            axes.set_visible(False)
        told = f"quality against speed (bars 95 %; hollow: not ranked{edges.told(found)})"
        canvas.title(figure, page, f"{canvas.told(panels[0].dataset)}: {told}")
        canvas.legend(figure, list(grid.flat))


def _marks(
    axes: Any,
    scores: Iterable[MethodSummary],
    value: str,
    look: Mapping[str, Mapping[str, Any]],
    edge: edges.Edge,
) -> None:
    for score in scores:
        mean = score.means[value]
        plain = {**look[score.label], "linestyle": "none", "markersize": 5.5}
        hollow = {"markerfacecolor": "white"} if score.unranked else {}
        axes.plot([score.fps], [mean.value], **plain, **hollow, label=canvas.told(score.label), zorder=3)
        edge.keep(score.fps or 0.0, mean, {**plain, **hollow})
        if mean.interval is not None:
            axes.vlines(
                score.fps, mean.interval.low, mean.interval.high, color=plain["color"], linewidth=0.9
            )


def _front(axes: Any, points: Sequence[tuple[float, float]], declared: DeclaredValue) -> None:
    """Steps along the points that none is both faster and better than."""
    front = best(points, declared)
    if len(front) > 1:
        axes.step(*zip(*front, strict=True), where="pre", color="0.7", linewidth=0.8, zorder=1)


def best(points: Sequence[tuple[float, float]], declared: DeclaredValue) -> list[tuple[float, float]]:
    """Those (speed, number) that no other is faster than and better, slowest first."""
    numbers = np.array([number for _, number in points])
    worse = statistics.losses(numbers, declared.better, declared.goal).tolist()
    front: list[tuple[float, float]] = []
    least = math.inf
    for (speed, number), loss in sorted(
        zip(points, worse, strict=True), key=lambda each: (-each[0][0], each[1])
    ):
        if loss < least:
            front.append((speed, number))
            least = loss
    return front[::-1]
