"""Error over the proportion of joints that are given: HuMoT's Figure 9, and the joints of its Figure 12."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.tasks import levels
from retarget_bench.evaluation.tasks.questions import MAJOR
from retarget_bench.figures import axis_limits
from retarget_bench.figures.plotting import canvas, edges
from retarget_bench.figures.plotting.levels import banded, lines, told
from retarget_bench.results import case_metadata

if TYPE_CHECKING:
    from retarget_bench.analysis.seen_unseen import SeenPart
    from retarget_bench.analysis.summary import Mean, SplitSummary
    from retarget_bench.results.store import ResultPaths

PANELS = {"restored_cm": "all joints", "restored_cm.missing": "joints that are not given"}

Points = list[tuple[float, "Mean"]]


def draw(
    path: Path,
    sections: Sequence[SplitSummary],
    major: float | None = None,
    halves: Sequence[SeenPart] = (),
    page: canvas.Page = canvas.PAGE,
) -> None:
    """Draw a line per method with its 95 % interval; all joints first, then the missing ones.

    sections: of one data set, one per level. major: per cent of the joints that the major ones are on
    average; they are drawn as larger hollow marks beside the lines, which are of random draws. halves: of
    trained methods, by level; theirs are two lines. Raises BenchError where no result has the errors, and
    where the file is of no known kind.
    """
    canvas.ending(path)
    at = {name: given for name in _levels(sections) if (given := levels.number(name)) is not None}
    apart = {MAJOR: major} if major is not None else {}
    known = [
        line
        for line in lines(sections, halves, next(iter(PANELS)), page)
        if line.points(next(iter(PANELS)), at | apart)
    ]
    if not known:
        raise BenchError(
            "these results have no restored_cm, which the metric restoration gives; bench task upsample "
            "with -m restoration, or without -m, computes it"
        )
    found: list[edges.Edge] = []
    beside = min(len(PANELS), page.across(3.0))
    with canvas.drawn(path, page.width, 2.6 * len(PANELS) / beside) as figure:
        panels = list(figure.subplots(len(PANELS) // beside, beside, sharex=True, squeeze=False).flat)
        for panel, (value, title) in zip(panels, PANELS.items(), strict=True):
            top = _top([line.points(value, at) for line in known])
            found.append(edges.Edge(-edges.BELOW * top, top))
            for line in known:
                banded(panel, line.name, line.points(value, at), line.look, found[-1])
                for place, mean in line.points(value, apart):
                    hollow = {**line.look, "markerfacecolor": "white", "markersize": 6}
                    panel.plot([place], [mean.value], **hollow)
            panel.set(title=title, ylim=found[-1].ends, ylabel="error, cm")
        edges.above(panels, found)
        for panel in panels[-beside:]:
            panel.set_xlabel("joints given, per cent" + (f" (large: {MAJOR} joints)" if apart else ""))
        canvas.title(figure, page, told(sections[0]) + edges.told(found))
        canvas.legend(figure, panels)


def _levels(sections: Sequence[SplitSummary]) -> list[str]:
    return [section.part for section in sections]


def major_share(places: Iterable[ResultPaths]) -> float | None:
    """Per cent of the joints that the major ones are, on average over cases; None where there are none."""
    shares = [
        100.0 * each["joints"] / each["of"]
        for place in places
        for each in case_metadata.read_conditions(place).values()
        if MAJOR in each
    ]
    return fmean(shares) if shares else None


def _top(lines: Iterable[Points]) -> float:
    """The upper end of an axis: above all lines, but for those that are far worse than most."""
    highest = [max(mean.value for _, mean in points) for points in lines if points]
    return 1.05 * axis_limits.top(highest, 3)
