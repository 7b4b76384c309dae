"""Numbers of charts: means over clips of parts of a split, and the cases that they are worst on."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.summary import Mean
from retarget_bench.report.chapters import Split
from retarget_bench.tables.model import count

WORST = 6
"""Cases that are kept behind the point of a curve and behind a joint."""


def grouped(split: Split, by: str) -> dict[str, list[Mean | None]]:
    """Group of the cases -> the mean of the main value, by method; groups in alphabetical order."""
    names = np.array(split.groups[by])
    return {
        name: means(split.numbers[:, names == name], split.panel.clips[names == name])
        for name in sorted(set(names.tolist()))
    }


def means(numbers: np.ndarray, clips: np.ndarray) -> list[Mean | None]:
    """The mean over clips of every row of ``(methods, cases)``; None where a row has no number."""
    per_clip = statistics.per_clip(numbers, clips)
    there, filled = ~np.isnan(numbers), ~np.isnan(per_clip)
    found: list[Mean | None] = []
    for row, interval in enumerate(statistics.mean_intervals(per_clip)):
        n, clip_count = int(there[row].sum()), int(filled[row].sum())
        value = float(np.nanmean(per_clip[row])) if clip_count else 0.0
        found.append(Mean(value, n, clip_count, interval) if n else None)
    return found


def worst(numbers: np.ndarray, better: str, goal: float = 1.0, most: int = WORST) -> str:
    """The worst few of ``(cases,)`` as ``case:number`` with spaces between, for the page's script."""
    loss = statistics.losses(numbers, better, goal)
    order = [int(case) for case in np.argsort(-loss, kind="stable") if not np.isnan(loss[case])]
    return " ".join(f"{case}:{numbers[case]:.4g}" for case in order[:most])


def told(mean: Mean, decimals: int, unit: str) -> str:
    """A mean in words."""
    text = f"{mean.value:.{decimals}f}{unit_text(unit)}"
    if mean.interval is not None:
        text += f", interval {mean.interval.low:.{decimals}f} to {mean.interval.high:.{decimals}f}"
    return f"{text}, {count(mean.n, 'case')} of {count(mean.clips, 'clip')}"


def unit_text(unit: str) -> str:
    """`` % of height``; nothing where there is no unit."""
    return "" if unit == "1" else f" {unit}"


def finite(numbers: Iterable[float | None]) -> list[float]:
    return [each for each in numbers if each is not None and np.isfinite(each)]
