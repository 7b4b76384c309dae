"""Error over the proportion of joints that are given: HuMoT's Figure 9, and the joints of its Figure 12."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import fmean, median
from typing import TYPE_CHECKING

from retarget_bench import marks
from retarget_bench.errors import BenchError
from retarget_bench.plotting import canvas
from retarget_bench.plotting.levels import banded, labels
from retarget_bench.tasks import levels
from retarget_bench.tasks.questions import MAJOR

if TYPE_CHECKING:
    from retarget_bench.records import Place
    from retarget_bench.summary import Mean, Section

PANELS = {"restored_cm": "all joints", "restored_cm.missing": "joints that are not given"}
HIGHEST = 2.5
"""How many times the median method's largest error the picture shows; what is worse leaves it."""

Points = list[tuple[float, "Mean"]]


def draw(path: Path, sections: Sequence[Section], major: float | None = None) -> None:
    """Draw a line per method with its 95 % interval; all joints at the left, missing ones at the right.

    sections: of one data set, one per level. major: per cent of the joints that the major ones are on
    average; they are drawn as hollow marks beside the lines, which are of random draws. Raises BenchError
    where no result has the errors, and where the file is of no known kind.
    """
    canvas.ending(path)
    drawn = [(section, at) for section in sections if (at := levels.number(section.part)) is not None]
    apart = [(section, major) for section in sections if section.part == MAJOR and major is not None]
    names = labels([section for section, _ in (*drawn, *apart)], next(iter(PANELS)))
    if not names:
        raise BenchError(
            "these results have no restored_cm, which the metric restoration gives; bench task upsample "
            "with -m restoration, or without -m, computes it"
        )
    look = canvas.looks({score.label: score.header for section in sections for score in section.scores})
    with canvas.drawn(path, 9.4, 4.2) as figure:
        panels = figure.subplots(1, len(PANELS), sharex=True)
        for panel, (value, title) in zip(panels, PANELS.items(), strict=True):
            lines = {label: _points(drawn, label, value) for label in names}
            for label, points in lines.items():
                banded(panel, names[label], points, look[label])
                for at, mean in _points(apart, label, value):
                    hollow = look[label] | {"markerfacecolor": "white", "markersize": 7}
                    panel.plot([at], [mean.value], **hollow)
            panel.set(title=title, ylim=(0, _top(lines.values())))
        panels[0].set_ylabel("error, cm")
        figure.supxlabel(
            "joints given, per cent" + (f" (hollow: {MAJOR} joints)" if apart else ""), fontsize=9
        )
        first = sections[0]
        figure.suptitle(
            f"{first.dataset}: {first.clips} clips at every level (mean over clips, bands 95 %)", fontsize=9
        )
        canvas.legend(figure, list(panels))


def major_share(places: Iterable[Place]) -> float | None:
    """Per cent of the joints that the major ones are, on average over cases; None where there are none."""
    shares = [
        100.0 * each["joints"] / each["of"]
        for place in places
        for each in marks.read_conditions(place).values()
        if MAJOR in each
    ]
    return fmean(shares) if shares else None


def _points(sections: Sequence[tuple[Section, float]], label: str, value: str) -> Points:
    return sorted(
        (
            (at, score.means[value])
            for section, at in sections
            for score in section.scores
            if score.label == label and value in score.means
        ),
        key=lambda point: point[0],
    )


def _top(lines: Iterable[Points]) -> float:
    """The upper end of an axis: above all lines, but for those that are far worse than most."""
    highest = [max(mean.value for _, mean in points) for points in lines if points]
    return max(1e-3, 1.05 * min(max(highest), HIGHEST * median(highest))) if highest else 1.0
