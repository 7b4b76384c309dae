"""What pictures over levels of a task share: a line per method, or two for those that training parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from retarget_bench.figures.plotting import canvas, edges

if TYPE_CHECKING:
    from retarget_bench.analysis.seen_unseen import SeenPart
    from retarget_bench.analysis.summary import Mean, MethodSummary, SplitSummary


FEW = 2
"""So many structures are named in a legend; of more it says how many they are."""


@dataclass(frozen=True)
class LevelLine:
    """One line of a picture.

    name:   in the legend. half: the method's label, and whether this is what training had; None: all of it.
    look:   what matplotlib takes.
    scores: (level, the method's numbers there).
    """

    name: str
    half: tuple[str, bool | None]
    look: Mapping[str, Any]
    scores: tuple[tuple[str, MethodSummary], ...]

    def points(self, value: str, at: Mapping[str, float]) -> list[tuple[float, Mean]]:
        """(place of the level, mean), from left to right. at: level -> its place; others are left out."""
        found = [
            (at[level], score.means[value])
            for level, score in self.scores
            if level in at and value in score.means
        ]
        return sorted(found, key=lambda point: point[0])


def lines(
    sections: Sequence[SplitSummary], halves: Sequence[SeenPart], value: str, page: canvas.Page
) -> list[LevelLine]:
    """A line per method that has the value anywhere, in order; two of one colour, full for structures that
    training had and dashed for others, of methods that have halves."""
    headers = {score.label: score.header for section in sections for score in section.scores}
    look = canvas.looks(headers, page)
    found = []
    for label, each in look.items():
        mine = [half for half in halves if half.label == label]
        for half in mine:
            which = ", ".join(half.structures)
            which = which if len(half.structures) <= FEW else f"{len(half.structures)} structures"
            name = f"{canvas.told(label)} ({'seen' if half.seen else 'unseen'}: {canvas.told(which)})"
            apart = each if half.seen else each | {"linestyle": canvas.UNSEEN, "markerfacecolor": "white"}
            found.append(_line(name, (label, half.seen), apart, half.sections))
        if not mine:
            found.append(_line(canvas.told(label), (label, None), each, sections))
    return [line for line in found if any(value in score.means for _, score in line.scores)]


def _line(
    name: str, half: tuple[str, bool | None], look: Mapping[str, Any], sections: Sequence[SplitSummary]
) -> LevelLine:
    """A line, whose name says of how many cases it is where the method did not answer all."""
    scores = [
        (section.part, score) for section in sections for score in section.scores if score.label == half[0]
    ]
    ok, asked = (sum(getattr(score, what) for _, score in scores) for what in ("ok", "asked"))
    told = name if ok == asked else f"{name} ({ok} of {asked} cases)"
    return LevelLine(told, half, look, tuple(scores))


def banded(
    panel: Any,
    name: str,
    points: Sequence[tuple[float, Mean]],
    look: Mapping[str, Any],
    edge: edges.Edge | None = None,
) -> None:
    """A line, and a band where all of it has intervals; the highest point of a line that leaves the axis is
    kept for the edge."""
    if not points:
        return
    if edge is not None:
        edge.keep(*max(points, key=lambda point: point[1].value), look)
    at = [each for each, _ in points]
    panel.plot(at, [mean.value for _, mean in points], label=name, **look)
    known = [mean.interval for _, mean in points if mean.interval is not None]
    if len(known) == len(points):
        low, high = zip(*((each.low, each.high) for each in known), strict=True)
        panel.fill_between(at, low, high, color=look["color"], alpha=0.12, linewidth=0)


def told(section: SplitSummary) -> str:
    """What a picture of these levels is of."""
    clips = f"{section.clips} clips at every level (mean over clips, bands 95 %)"
    return f"{canvas.told(section.dataset)}\n{clips}"
