"""Values of the results as sets, and their files."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import write_csv
from retarget_bench.results.store import ResultPaths


@dataclass(frozen=True)
class SetValue:
    """One value of the results on one target structure, or of another set that a metric names.

    kind:    of the cases, where they have no references and are also compared kind by kind; "": all.
    n:       windows in each set. clips: source clips that they come from, both halves together.
    value:   None where it is not applicable; ``reason`` says why.
    low, high: 95 % interval, or None where there are too few clips for one.
    floor:   what the references score instead of the results.
    without: the value without each tenth of the clips, for the jackknife; () where there are too few.
    real:    hash of the real set; values are comparable where it agrees.
    """

    value_id: str
    structure: str
    n: int
    clips: int
    value: float | None = None
    low: float | None = None
    high: float | None = None
    floor: float | None = None
    real: str = ""
    reason: str = ""
    kind: str = ""
    without: tuple[float, ...] = ()

    @property
    def tenths(self) -> np.ndarray | None:
        """A number ``(10,)`` per tenth of the clips: their mean is the value, and their standard error the
        jackknife's. None where there are too few clips."""
        if self.value is None or not self.without:
            return None
        without = np.asarray(self.without)
        return self.value + (len(without) - 1) * (without.mean() - without)


FIELDS = tuple(field.name for field in fields(SetValue))
OPTIONAL = ("kind", "without")
"""Columns that a file has where any value needs them."""
COUNTS, NUMBERS = ("n", "clips"), ("value", "low", "high", "floor")


def write(paths: ResultPaths, values: Sequence[SetValue]) -> None:
    """``<method>.sets.csv``, sorted, with nine significant digits; none where there is no value."""
    path = paths.sets
    if not values:
        path.unlink(missing_ok=True)
        return
    used = [name for name in FIELDS if name not in OPTIONAL or any(getattr(each, name) for each in values)]
    ordered = sorted(values, key=lambda value: (value.value_id, value.structure, value.kind))
    write_csv(path, used, ([_text(getattr(value, name)) for name in used] for value in ordered))


def read(paths: ResultPaths) -> list[SetValue]:
    """The values of a result, sorted by id, structure and kind; none where no set metric was computed.

    Raises FileError where the file is damaged.
    """
    path = paths.sets
    try:
        with path.open(encoding="utf-8", newline="") as file:
            head, *rows = list(csv.reader(file))
            if head != [name for name in FIELDS if name not in OPTIONAL or name in head]:
                raise ValueError(f"it has columns {', '.join(head)}")
            absent = dict.fromkeys(OPTIONAL, "")
            return [_value(absent | dict(zip(head, row, strict=True))) for row in rows]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, csv.Error) as error:
        raise FileError(
            path, f"cannot be read as values of sets ({error}); score the method again"
        ) from error


def _text(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(map(_text, value))
    return "" if value is None else f"{value:.9g}" if isinstance(value, float) else str(value)


def _value(row: Mapping[str, str]) -> SetValue:
    numbers = {name: float(row[name]) if row[name] else None for name in NUMBERS}
    without = tuple(map(float, row["without"].split()))
    if not np.isfinite([*without, *(number for number in numbers.values() if number is not None)]).all():
        raise ValueError(f"{row['value_id']} of {row['structure']} is no number")
    texts = {name: row[name] for name in FIELDS if name not in (*COUNTS, *NUMBERS, "without")}
    counts = {name: int(row[name]) for name in COUNTS}
    return SetValue(**texts, **counts, **numbers, without=without)  # type: ignore[arg-type]
