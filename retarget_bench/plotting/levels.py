"""What pictures over levels of a task share: which methods, and lines with bands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from retarget_bench.summary import Mean, Section


def labels(sections: Sequence[Section], value: str) -> dict[str, str]:
    """Label of every method that has the value anywhere -> its name in the legend, which says of how many
    cases where it did not answer all."""
    found: dict[str, list[int]] = {}
    there = set()
    for section in sections:
        for score in section.scores:
            counts = found.setdefault(score.label, [0, 0])
            counts[0] += score.ok
            counts[1] += score.asked
            if value in score.means:
                there.add(score.label)
    return {
        label: label if ok == asked else f"{label}\n({ok} of {asked} cases)"
        for label, (ok, asked) in found.items()
        if label in there
    }


def banded(panel: Any, name: str, points: Sequence[tuple[float, Mean]], look: Mapping[str, Any]) -> None:
    """A line, and a band where all of it has intervals."""
    if not points:
        return
    at = [each for each, _ in points]
    panel.plot(at, [mean.value for _, mean in points], label=name, **look)
    known = [mean.interval for _, mean in points if mean.interval is not None]
    if len(known) == len(points):
        low, high = zip(*((each.low, each.high) for each in known), strict=True)
        panel.fill_between(at, low, high, color=look["color"], alpha=0.12, linewidth=0)
