"""Dots with intervals beside each other: a row per group, a mark per method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from retarget_bench.figures.plotting import canvas, edges

if TYPE_CHECKING:
    from retarget_bench.analysis.summary import Mean

ROOM = 0.7
"""Of a row's height, what its marks share."""


def dots(
    panel: Any,
    groups: Sequence[str],
    means: Mapping[str, Sequence[Mean | None]],
    look: Mapping[str, Mapping[str, Any]],
    edge: edges.Edge,
) -> None:
    """Draw the groups from top to bottom; in each row a mark per method, and its interval as a line.

    means: label -> a mean per group, or None where the method has none. edge: where the axis ends.
    """
    for place, (label, row) in enumerate(means.items()):
        shift = ROOM * ((place + 0.5) / len(means) - 0.5)
        known = [(at + shift, mean) for at, mean in enumerate(row) if mean is not None]
        marks = {**look[label], "linestyle": "none", "label": canvas.told(label)}
        panel.plot([mean.value for _, mean in known], [at for at, _ in known], **marks)
        for at, mean in known:
            edge.keep(at - shift, mean, look[label])
        spans = [(at, mean.interval) for at, mean in known if mean.interval is not None]
        panel.hlines(
            [at for at, _ in spans], [i.low for _, i in spans], [i.high for _, i in spans],
            color=look[label]["color"], linewidth=0.9,
        )  # fmt: skip
    for at in range(0, len(groups), 2):
        panel.axhspan(at - 0.5, at + 0.5, color="0.5", alpha=0.08, linewidth=0)
    panel.set_yticks(range(len(groups)), [canvas.told(group) for group in groups])
    panel.set(ylim=(len(groups) - 0.5, -0.5), xlim=edge.ends)
    edges.beside(panel, edge)
    panel.tick_params(axis="y", length=0)
    panel.grid(visible=False, axis="y")
