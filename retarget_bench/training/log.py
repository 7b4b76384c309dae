"""``log.csv``, a row every few steps with the mean of every loss term, and ``loss.png``, its picture."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic, write_text
from retarget_bench.training.phases import NORM
from retarget_bench.training.record import DECISIVE

NAME = "log.csv"
EVERY = 10
"""Steps between rows. Checkpoints are made where rows end, so that no mean is cut in two."""
FIXED = ("step", "seconds", "rate")
VALIDATION = "validation"
"""Columns with this prefix are filled in the rows where a validation was."""
PICTURE = "loss.png"
SMOOTHED = 200
"""About how many points a curve of losses has; each is the mean of the rows that it stands for."""

Series = tuple[np.ndarray, np.ndarray]


class Log:
    """The file of one run, and what was measured since its last row."""

    def __init__(self, folder: Path, step: int = 0) -> None:
        """Continue a log from a checkpoint's step: rows of later steps are cut off."""
        self._path = folder / NAME
        rows = [row for row in read(folder) if int(row["step"]) <= step] if step else []
        self.columns = [name for name in (rows[0] if rows else FIXED) if any(r[name] for r in rows)]
        self.columns = self.columns or list(FIXED)
        self._sums: dict[str, tuple[float, int]] = {}
        self._write([{name: row[name] for name in self.columns} for row in rows])

    def add(self, measured: Mapping[str, float]) -> None:
        """Record the measurements of one step."""
        for name, value in measured.items():
            total, count = self._sums.get(name, (0.0, 0))
            self._sums[name] = (total + value, count + 1)

    @property
    def means(self) -> dict[str, float]:
        """Since the last row."""
        return {name: total / count for name, (total, count) in self._sums.items()}

    def row(self, step: int, seconds: float, rate: float, validation: Mapping[str, float]) -> None:
        """End a row. Raises FileError."""
        cells = {"step": str(step), "seconds": f"{seconds:.2f}", "rate": f"{rate:.6g}"}
        cells |= {name: f"{value:.9g}" for name, value in (self.means | dict(validation)).items()}
        self._sums = {}
        if new := [name for name in cells if name not in self.columns]:
            self.columns += new
            self._write(read(self._path.parent))
        try:
            with self._path.open("a", encoding="utf-8", newline="") as file:
                file.write(_lines(self.columns, [cells]))
        except OSError as error:
            raise FileError(self._path, f"cannot be written ({error.strerror or error})") from error

    def _write(self, rows: Sequence[Mapping[str, str]]) -> None:
        header = ",".join(self.columns) + "\n"
        write_text(self._path, header + _lines(self.columns, rows))


def _lines(columns: Sequence[str], rows: Sequence[Mapping[str, str]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writerows(rows)
    return text.getvalue()


def read(folder: Path) -> list[dict[str, str]]:
    """All whole rows of a log; none where there is no file. A row that a killed process left is dropped.

    Raises FileError for any other file than a log.
    """
    path = folder / NAME
    try:
        text = path.read_text(encoding="utf-8")
        complete = text[: text.rfind("\n") + 1]
        rows = [dict(row) for row in csv.DictReader(io.StringIO(complete), strict=True)]
        for row in rows:
            if missing := set(FIXED) - set(row):
                raise ValueError(f"it has no {', '.join(sorted(missing))}")
            int(row["step"])
            for cell in row.values():
                if cell != "":
                    float(cell)
    except FileNotFoundError:
        return []
    except (OSError, ValueError, KeyError, TypeError, csv.Error) as error:
        raise FileError(
            path, f"is not the log of a training run ({error}); without this file a new one is begun"
        ) from error
    return rows


# ------------------------------------------------------------------------------------------- curves
def draw(folder: Path, title: str) -> None:
    """Draw the log of a folder: losses above, validation below where there is one. Raises FileError."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = read(folder)
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
            style = {"color": f"C{splits.index(split)}", "linestyle": "-" if value == DECISIVE else ":"}
            panels[-1].plot(steps, values, label=name, marker=".", linewidth=1.2, **style)
        if validation:
            panels[-1].set(ylabel="validation error, % of height")
            panels[-1].set_ylim(bottom=0)
        panels[-1].set_xlabel("step")
        for panel in panels:
            if panel.lines:
                panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
        with atomic(folder / PICTURE) as temporary:
            figure.savefig(temporary, dpi=110, format="png")


def losses(folder: Path, points: int) -> list[dict[str, float]]:
    """The loss terms of a log as so many points at most, each the mean of the rows since the one before."""
    series = _losses(read(folder), points)
    steps = sorted({int(step) for each, _ in series.values() for step in each})
    terms: dict[int, dict[str, float]] = {step: {"step": step} for step in steps}
    for name, (each, values) in series.items():
        for step, value in zip(each, values, strict=True):
            terms[int(step)][name] = float(f"{value:.5g}")
    return list(terms.values())


def _losses(rows: Sequence[dict[str, str]], points: int = SMOOTHED) -> dict[str, Series]:
    terms = [
        name
        for name in (rows[0] if rows else ())
        if name not in FIXED and not name.startswith(f"{VALIDATION} ") and not name.endswith(f".{NORM}")
    ]
    return {name: _thinned(*_filled(rows, name), points) for name in terms}


def _validation(rows: Sequence[dict[str, str]]) -> dict[str, Series]:
    """``SPLIT VALUE`` -> the steps of validations and what was measured."""
    head = f"{VALIDATION} "
    names = [name for name in (rows[0] if rows else ()) if name.startswith(head)]
    return {n.removeprefix(head): _filled(rows, n) for n in names if not n.endswith(" n")}


def _filled(rows: Sequence[dict[str, str]], name: str) -> Series:
    """The rows in which a column has a value."""
    points = [(float(row["step"]), float(row[name])) for row in rows if row[name]]
    both = np.array(points, dtype=np.float64).reshape(-1, 2)
    return both[:, 0], both[:, 1]


def _thinned(steps: np.ndarray, values: np.ndarray, points: int) -> Series:
    size = max(1, -(-len(steps) // points))
    cuts = np.arange(0, len(steps), size)
    if not len(cuts):
        return steps, values
    last = np.minimum(cuts + size, len(steps)) - 1
    counts = np.diff(np.append(cuts, len(steps)))
    return steps[last], np.add.reduceat(values, cuts) / counts
