"""``loss.png``: what fell while training, from ``log.csv`` alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from retarget_bench import defaults
from retarget_bench.files import atomic
from retarget_bench.training import log
from retarget_bench.training.phases import NORM

NAME = "loss.png"
SMOOTHED = 200
"""About how many points a curve of losses has; each is the mean of the rows that it stands for."""
DECISIVE = defaults.VALIDATION[1][0]

Series = tuple[np.ndarray, np.ndarray]


def draw(folder: Path, title: str) -> None:
    """Draw the log of a folder: losses above, validation below where there is one. Raises FileError."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = log.read(folder)
    losses, validation = _losses(rows), _validation(rows)
    with mpl.rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3}):
        figure = Figure(figsize=(9, 4 + 3 * bool(validation)), layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(1 + bool(validation), 1, squeeze=False, sharex=True)[:, 0]
        for name, (steps, values) in losses.items():
            panels[0].plot(steps, values, label=name, linewidth=1.2)
        if any((values > 0).any() for _, values in losses.values()):
            panels[0].set_yscale("log")
        panels[0].set(title=title, ylabel="loss (weighted terms)")
        splits = list(dict.fromkeys(name.split(" ")[0] for name in validation))
        for name, (steps, values) in validation.items():
            split, _, value = name.partition(" ")
            look = {"color": f"C{splits.index(split)}", "linestyle": "-" if value == DECISIVE else ":"}
            panels[-1].plot(steps, values, label=name, marker=".", linewidth=1.2, **look)
        if validation:
            panels[-1].set(ylabel="validation error, % of height")
            panels[-1].set_ylim(bottom=0)
        panels[-1].set_xlabel("step")
        for panel in panels:
            if panel.lines:
                panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
        with atomic(folder / NAME) as temporary:
            figure.savefig(temporary, dpi=110, format="png")


def losses(folder: Path, points: int) -> list[dict[str, float]]:
    """The loss terms of a log as so many points at most, each the mean of the rows since the one before."""
    series = _losses(log.read(folder), points)
    steps = sorted({int(step) for each, _ in series.values() for step in each})
    found: dict[int, dict[str, float]] = {step: {"step": step} for step in steps}
    for name, (each, values) in series.items():
        for step, value in zip(each, values, strict=True):
            found[int(step)][name] = float(f"{value:.5g}")
    return list(found.values())


def _losses(rows: Sequence[dict[str, str]], points: int = SMOOTHED) -> dict[str, Series]:
    names = [name for name in (rows[0] if rows else ()) if name not in log.FIXED]
    wanted = [
        name for name in names if name.split(" ")[0] != log.VALIDATION and name.split(".")[-1] != NORM
    ]
    return {name: _thinned(*_filled(rows, name), points) for name in wanted}


def _validation(rows: Sequence[dict[str, str]]) -> dict[str, Series]:
    """``SPLIT VALUE`` -> the steps of validations and what was measured."""
    names = [name for name in (rows[0] if rows else ()) if name.startswith(log.VALIDATION + " ")]
    return {
        name.removeprefix(log.VALIDATION + " "): _filled(rows, name)
        for name in names
        if not name.endswith(" n")
    }


def _filled(rows: Sequence[dict[str, str]], name: str) -> Series:
    """The rows in which a column has a value."""
    kept = [(float(row["step"]), float(row[name])) for row in rows if row[name]]
    both = np.array(kept, dtype=np.float64).reshape(-1, 2)
    return both[:, 0], both[:, 1]


def _thinned(steps: np.ndarray, values: np.ndarray, points: int) -> Series:
    size = max(1, -(-len(steps) // points))
    cuts = np.arange(0, len(steps), size)
    if not len(cuts):
        return steps, values
    last = np.minimum(cuts + size, len(steps)) - 1
    counts = np.diff(np.append(cuts, len(steps)))
    return steps[last], np.add.reduceat(values, cuts) / counts
