"""Foot contacts kept, over how slow counts as planted: PAN's Figure 7, with precision below recall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from retarget_bench.errors import BenchError
from retarget_bench.figures.plotting import canvas
from retarget_bench.figures.plotting.levels import banded

if TYPE_CHECKING:
    from retarget_bench.analysis.summary import Mean, SplitSummary

KINDS = {"pan_recall": "recall", "pan_contact_precision": "precision"}
"""Value -> what its row of panels is called. A foot that never moves has recall 1; hence both."""
AXES = {
    "": "squared step in 1/30 s, cm²",
    "_h": "step in 1/30 s, heights",
}


def draw(
    path: Path, sections: Sequence[SplitSummary], by_height: bool, page: canvas.Page = canvas.PAGE
) -> None:
    """Draw recall above precision, a column per split, a line per method with its 95 % interval.

    sections: of one data set. by_height: thresholds of speed in heights, not squared ones in centimetres.
    On narrow pages a row per split instead. Raises BenchError where no result has the curves, and where the
    file is of no known kind.
    """
    canvas.ending(path)
    suffix = "_h" if by_height else ""
    shown = [section for section in sections if _lines(section, f"pan_recall{suffix}")]
    if not shown:
        raise BenchError(
            f"these results have no pan_recall{suffix}, which the metric pan_contact gives; bench run with "
            "-m pan_contact, or without -m, computes it from the predictions that there are"
        )
    headers = {score.label: score.header for section in shown for score in section.scores}
    look = canvas.looks(headers, page)
    upright = page.across(1.9) < len(shown)
    rows, columns = (len(shown), len(KINDS)) if upright else (len(KINDS), len(shown))
    with canvas.drawn(path, page.width, 0.5 + 1.9 * rows) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        panels = grid.T if upright else grid
        for column, section in zip(panels.T, shown, strict=True):
            column[0].set_title(f"{section.split}: {section.clips} clips, {section.pairs} pairs")
            for panel, kind in zip(column, KINDS, strict=True):
                for label, curve in _lines(section, kind + suffix).items():
                    points = sorted((float(threshold), mean) for threshold, mean in curve.items())
                    banded(panel, canvas.told(label), points, look[label])
        for row, name in zip(panels, KINDS.values(), strict=True):
            for panel in row if upright else row[:1]:
                panel.set_ylabel(f"{name} of foot contacts")
        panels[0, 0].set(xscale="log", ylim=(-0.02, 1.02))
        ticks = _thresholds(shown, f"pan_recall{suffix}")
        panels[0, 0].set_xticks(ticks, [f"{each:g}" for each in ticks])
        panels[0, 0].minorticks_off()
        for panel in grid[-1]:
            panel.tick_params(axis="x", labelrotation=45)
            panel.set_xlabel(AXES[suffix])
        what = "foot contacts kept, over how slow counts as planted (mean over clips, bands 95 %)"
        canvas.title(figure, page, f"{canvas.told(shown[0].dataset)}: {what}")
        canvas.legend(figure, list(panels.flat))


def _lines(section: SplitSummary, value: str) -> dict[str, Mapping[str, Mean]]:
    """Label -> its curve, of those that have it."""
    return {score.label: score.curves[value] for score in section.scores if value in score.curves}


def _thresholds(sections: Sequence[SplitSummary], value: str) -> list[float]:
    curves = [curve for section in sections for curve in _lines(section, value).values()]
    return sorted({float(threshold) for curve in curves for threshold in curve})
