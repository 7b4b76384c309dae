"""Error after denoising over the error before: HuMoT's Figure 8."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget_bench.errors import BenchError
from retarget_bench.plotting import canvas
from retarget_bench.plotting.levels import banded, labels
from retarget_bench.tasks import levels

if TYPE_CHECKING:
    from retarget_bench.summary import Section

BEFORE, AFTER = "given_cm", "restored_cm"
ROOM = 1.08
"""How much higher than the noise itself the picture goes: what is above has added to it."""


def draw(path: Path, sections: Sequence[Section]) -> None:
    """Draw a line per method with its 95 % interval, over the error of what it was given.

    The diagonal is giving the source back. Flatter is better, and what leaves the picture at the top is far
    worse than doing nothing. sections: of one data set, one per level. Raises BenchError where no result
    has both errors, and where the file is of no known kind.
    """
    canvas.ending(path)
    given = {section.part: before for section in sections if (before := _before(section)) is not None}
    if not given:
        raise BenchError(
            f"these results have no {BEFORE} beside {AFTER}, which the metric restoration gives; bench "
            "task denoise with -m restoration, or without -m, computes them"
        )
    shown = [section for section in sections if section.part in given]
    names = labels(shown, AFTER)
    look = canvas.looks({score.label: score.header for section in shown for score in section.scores})
    most = max(*given.values(), 1e-3)
    with canvas.drawn(path, 7.4, 4.6) as figure:
        panel = figure.subplots()
        panel.plot([0, most], [0, most], color="0.6", linewidth=0.8, linestyle=(0, (1, 2)), zorder=1)
        for label, name in names.items():
            banded(panel, name, _line(shown, label, given), look[label])
        panel.set(
            xlim=(-0.02 * most, 1.02 * most),
            ylim=(-0.02 * most, ROOM * most),
            xlabel="error before: joints of the noisy source, cm",
            ylabel="error after: joints of the answer, cm",
        )
        _deviations(panel, given)
        first = shown[0]
        figure.suptitle(
            f"{first.dataset}\n{first.clips} clips at every level (mean over clips, bands 95 %)", fontsize=9
        )
        canvas.legend(figure, [panel])


def _before(section: Section) -> float | None:
    """The error of the sources of a level: of a method that answered most cases."""
    found = [
        (mean.n, mean.value)
        for score in section.scores
        if AFTER in score.means and (mean := score.means.get(BEFORE)) is not None
    ]
    return max(found)[1] if found else None


def _line(sections: Sequence[Section], label: str, given: Mapping[str, float]) -> list[tuple[float, Any]]:
    """(error before, mean error after) of one method, by level."""
    return sorted(
        (
            (given[section.part], score.means[AFTER])
            for section in sections
            for score in section.scores
            if score.label == label and AFTER in score.means
        ),
        key=lambda point: point[0],
    )


def _deviations(panel: Any, given: Mapping[str, float]) -> None:
    """The standard deviations of the noise, as ticks at the top."""
    top = panel.secondary_xaxis("top")
    told = {at: number for name, at in given.items() if (number := levels.number(name)) is not None}
    top.set_xticks(list(told), [f"{number:g}" for number in told.values()])
    top.set_xlabel("standard deviation of the noise on each coordinate, cm")
