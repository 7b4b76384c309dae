"""Error after denoising over the error before: HuMoT's Figure 8."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.tasks import levels
from retarget_bench.figures.plotting import canvas
from retarget_bench.figures.plotting.levels import banded, lines, told

if TYPE_CHECKING:
    from retarget_bench.analysis.seen_unseen import SeenPart
    from retarget_bench.analysis.summary import SplitSummary

BEFORE, AFTER = "given_cm", "restored_cm"
ROOM = 1.08
"""How much higher than the noise itself the picture goes: what is above has added to it."""


def draw(
    path: Path,
    sections: Sequence[SplitSummary],
    halves: Sequence[SeenPart] = (),
    page: canvas.Page = canvas.PAGE,
) -> None:
    """Draw a line per method with its 95 % interval, over the error of what it was given.

    The diagonal is giving the source back. Flatter is better, and what leaves the picture at the top is far
    worse than doing nothing. sections: of one data set, one per level. halves: of trained methods, by
    level; theirs are two lines, each over the error of what that half was given. Raises BenchError where no
    result has both errors, and where the file is of no known kind.
    """
    canvas.ending(path)
    given = _given(sections)
    if not given:
        raise BenchError(
            f"these results have no {BEFORE} beside {AFTER}, which the metric restoration gives; bench "
            "task denoise with -m restoration, or without -m, computes them"
        )
    shown = [section for section in sections if section.part in given]
    own: dict[tuple[str, bool | None], dict[str, float]] = {
        (half.label, half.seen): _given(half.sections) for half in halves
    }
    most = max(*given.values(), *(each for half in own.values() for each in half.values()), 1e-3)
    with canvas.drawn(path, page.width, 0.3 + 0.75 * min(page.width, 4.2)) as figure:
        panel = figure.subplots()
        panel.plot([0, most], [0, most], color="0.6", linewidth=0.8, linestyle=(0, (1, 2)), zorder=1)
        for line in lines(shown, halves, AFTER, page):
            banded(panel, line.name, line.points(AFTER, own.get(line.half, given)), line.look)
        panel.set(
            xlim=(-0.02 * most, 1.02 * most),
            ylim=(-0.02 * most, ROOM * most),
            xlabel="error before: joints of the noisy source, cm",
            ylabel="error after: joints of the answer, cm",
        )
        _deviations(panel, given)
        canvas.title(figure, page, told(shown[0]))
        canvas.legend(figure, [panel])


def _given(sections: Sequence[SplitSummary]) -> dict[str, float]:
    """Level -> the error of its sources."""
    return {section.part: before for section in sections if (before := _before(section)) is not None}


def _before(section: SplitSummary) -> float | None:
    """The error of the sources of a level: of a method that answered most cases."""
    found = [
        (mean.n, mean.value)
        for score in section.scores
        if AFTER in score.means and (mean := score.means.get(BEFORE)) is not None
    ]
    return max(found)[1] if found else None


def _deviations(panel: Any, given: Mapping[str, float]) -> None:
    """The standard deviations of the noise, as ticks at the top."""
    top = panel.secondary_xaxis("top")
    told = {at: number for name, at in given.items() if (number := levels.number(name)) is not None}
    top.set_xticks(list(told), [f"{number:g}" for number in told.values()])
    top.set_xlabel("standard deviation of the noise on each coordinate, cm")
