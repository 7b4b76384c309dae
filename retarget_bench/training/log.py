"""``log.csv``: one row every few steps, with the mean of every loss term since the row before."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from retarget_bench.errors import FileError
from retarget_bench.files import write_text

NAME = "log.csv"
EVERY = 10
"""Steps between rows. Checkpoints are made where rows end, so that no mean is cut in two."""
FIXED = ("step", "seconds", "rate")
VALIDATION = "validation"
"""Columns with this prefix are filled in the rows where a validation was."""


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
        """What one step measured."""
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
        whole = text[: text.rfind("\n") + 1]
        rows = [dict(row) for row in csv.DictReader(io.StringIO(whole), strict=True)]
        for row in rows:
            _check(row)
    except FileNotFoundError:
        return []
    except (OSError, ValueError, KeyError, TypeError, csv.Error) as error:
        raise FileError(
            path, f"is not the log of a training run ({error}); without this file a new one is begun"
        ) from error
    return rows


def _check(row: Mapping[str, str]) -> None:
    """Raises ValueError, KeyError or TypeError unless every cell is empty or a number."""
    int(row["step"])
    for name, cell in row.items():
        if name is None or cell != "":
            float(cell)
    if missing := set(FIXED) - set(row):
        raise ValueError(f"it has no {', '.join(sorted(missing))}")
