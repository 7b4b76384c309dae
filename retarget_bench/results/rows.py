"""The numbers of results as columns over the case list, and the files that hold them.

Text (``.csv``) holds a row per number, so that results can be compared line by line; an archive of arrays
(``.npz``) the values per joint or frame, too many for text. Of many cases one Parquet file holds both, of
which columns are read when they are asked for. Numbers have nine significant digits in all of them.
"""

import csv
import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import LARGEST, atomic, check_ordinary, write_csv
from retarget_bench.results.paths import CaseResult

MANY = 20_000
"""Results of more cases are stored as Parquet."""
ROW_FIELDS = ("case", "value_id", "index", "value")

Key = tuple[str, str]
"""A value's id and the index of a point of its curve, or ""."""
Numbers = Mapping[Key, np.ndarray]
"""Key -> ``(cases,)``, nan where a case has no such number."""


class Lazy(Numbers):
    """Columns that are made when they are asked for."""

    def __init__(self, keys: Iterable[Key], make: Callable[[Key], np.ndarray]) -> None:
        self._keys, self._make = dict.fromkeys(keys), make

    def __getitem__(self, key: Key) -> np.ndarray:
        if key not in self._keys:
            raise KeyError(key)
        return self._make(key)

    def __contains__(self, key: object) -> bool:
        return key in self._keys

    def __iter__(self) -> Iterator[Key]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)


def derived(
    source: Numbers, make: Callable[[Key], np.ndarray], keys: Iterable[Key] | None = None
) -> Numbers:
    """Columns made of those of ``source``: at once, or when they are asked for where the source's are."""
    columns = Lazy(source if keys is None else keys, make)
    return columns if isinstance(source, Lazy) else dict(columns)


# -------------------------------------------------------------------------------------- single cases
def columns_of(entries: Iterable[CaseResult], cases: Sequence[str]) -> dict[Key, np.ndarray]:
    """The numbers of entries over a list of cases."""
    columns = defaultdict[Key, np.ndarray](partial(np.full, len(cases), np.nan))
    position = {case: at for at, case in enumerate(cases)}
    for entry in entries:
        for value_id, value in entry.values.items():
            for index, number in value.items() if isinstance(value, dict) else (("", value),):
                columns[value_id, index][position[entry.case]] = number
    return dict(columns)


def entries_of(numbers: Numbers, cases: Sequence[str]) -> dict[str, CaseResult]:
    """Case -> its numbers, of every case that has any."""
    entries: dict[str, CaseResult] = {}
    for (value_id, index), column in numbers.items():
        for at in np.flatnonzero(~np.isnan(column)).tolist():
            values = entries.setdefault(cases[at], CaseResult(cases[at], "ok")).values
            curve: Any = values.setdefault(value_id, {}) if index else values
            curve[index or value_id] = float(column[at])
    return entries


# ------------------------------------------------------------------------------------------------ text
def write_rows(path: Path, cases: Sequence[str], numbers: Numbers) -> None:
    """Write a row per number, sorted by case, value and index. cases: sorted."""
    columns = [(key, numbers[key].tolist()) for key in sorted(numbers)]
    write_csv(
        path,
        ROW_FIELDS,
        (
            (case, *key, f"{column[at]:.9g}")
            for at, case in enumerate(cases)
            for key, column in columns
            if not math.isnan(column[at])
        ),
    )


def read_rows(path: Path, cases: Sequence[str]) -> dict[Key, np.ndarray]:
    """The numbers of a file of rows. Raises FileError with the line of the first fault."""
    columns = defaultdict[Key, list[float]](lambda: [math.nan] * len(cases))  # arrays take longer to fill
    position = {case: at for at, case in enumerate(cases)}
    for line, (case, value_id, index, text) in enumerate(csv_rows(path, ROW_FIELDS), 2):
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise FileError(path, f"{text!r} is not a number", line)
        if case not in position:
            raise FileError(path, f"names case {case!r}, which the case list beside it does not list", line)
        column, at = columns[value_id, index], position[case]
        if not math.isnan(column[at]):
            raise FileError(path, f"{value_id!r} of {case!r} is listed twice", line)
        column[at] = number
    if both := {value for value, index in columns if index} & {
        value for value, index in columns if not index
    }:
        raise FileError(path, f"{min(both)!r} is both a number and a curve")
    return {key: np.array(column) for key, column in columns.items()}


def read_csv(path: Path, fields: Sequence[str]) -> list[list[str]]:
    """The rows below a heading of these fields. Raises FileError with the line of the first fault."""
    return list(csv_rows(path, fields))


def csv_rows(path: Path, fields: Sequence[str]) -> Iterator[list[str]]:
    """The same, row by row."""
    check_ordinary(path)
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = csv.reader(file)
            head = next(rows, None)
            if head is None:
                raise ValueError("it is empty")
            if tuple(head) != tuple(fields):
                raise FileError(path, f"has columns {', '.join(head)}; expected {', '.join(fields)}", 1)
            for line, row in enumerate(rows, 2):
                if len(row) != len(fields):
                    raise FileError(path, f"has {len(row)} cells instead of {len(fields)}", line)
                yield row
    except (OSError, ValueError, csv.Error) as error:
        raise FileError(path, f"cannot be read as a table ({error})") from error


# ------------------------------------------------------------------------------------------- archives
def write_arrays(path: Path, cases: Sequence[str], numbers: Numbers) -> None:
    """Write ``cases``, and of every value ``<value id>`` ``(cases, points)`` and ``<value id>:points``."""
    arrays: dict[str, Any] = {"cases": np.array(cases)}
    for value in sorted({value for value, _ in numbers}):
        points = sorted(index for each, index in numbers if each == value)
        arrays[f"{value}:points"] = np.array(points)
        arrays[value] = np.stack([_nine_digits(numbers[value, point]) for point in points], axis=1)
    write_npz(path, arrays, compressed=True)


def read_arrays(path: Path, cases: Sequence[str]) -> dict[Key, np.ndarray]:
    """The numbers of such an archive. Raises FileError."""
    arrays = read_npz(path, "cannot be read; run the method again", LARGEST)
    columns: dict[Key, np.ndarray] = {}
    try:
        if arrays["cases"].tolist() != list(cases):
            raise ValueError("it is of other cases than the case list beside it")
        for value in arrays:
            if f"{value}:points" in arrays:
                points = arrays[f"{value}:points"].tolist()
                table = np.asarray(arrays[value], float).reshape(len(cases), len(points))
                columns |= {(value, str(point)): table[:, at] for at, point in enumerate(points)}
    except (KeyError, ValueError, TypeError) as error:
        raise FileError(path, f"cannot be read; run the method again ({error})") from error
    return columns


def _nine_digits(column: np.ndarray) -> np.ndarray:
    return np.array([float(f"{number:.9g}") for number in column.tolist()])


def write_npz(path: Path, arrays: Mapping[str, Any], compressed: bool = False) -> None:
    """Write arrays by name, atomically. Raises FileError."""
    with atomic(path) as temporary, temporary.open("wb") as stream:
        (np.savez_compressed if compressed else np.savez)(stream, **arrays)


def read_npz(path: Path, problem: str, most: float = math.inf) -> dict[str, np.ndarray]:
    """All arrays of a file. Raises FileError that states the problem where it is none, or where it unpacks
    to more than ``most`` bytes."""
    check_ordinary(path)
    try:
        with path.open("rb") as opened, np.load(opened) as file:
            if (size := sum(each.file_size for each in file.zip.infolist())) > most:
                raise ValueError(f"it unpacks to {size:,} bytes, more than the {most:,} that are read")
            return {name: file[name] for name in file.files}
    except Exception as error:  # an archive from elsewhere makes its readers raise all kinds
        raise FileError(path, f"{problem} ({error})") from error


# -------------------------------------------------------------------------------------------- Parquet
def parquet() -> Any:
    """The module that reads and writes Parquet. Raises BenchError where it is not installed."""
    try:
        import pyarrow.parquet  # type: ignore[import-untyped]
    except ImportError as error:
        raise BenchError(
            f"results of more than {MANY:,} cases are stored as Parquet, which needs pyarrow: "
            "pip install 'retarget-bench[store]'"
        ) from error
    return pyarrow.parquet


def write_large(path: Path, cases: Sequence[str], numbers: Numbers) -> None:
    """Write a row per case and a column per number, ``<value id>`` or ``<value id>:<index>``, atomically.

    Raises BenchError without pyarrow, FileError.
    """
    module = parquet()
    import pyarrow

    columns = {":".join(filter(None, key)): _nine_digits(numbers[key]) for key in sorted(numbers)}
    table = pyarrow.table({"case": list(cases), **columns})
    options = {"compression": "zstd", "use_dictionary": False, "write_page_checksum": True}
    with atomic(path) as temporary:
        module.write_table(table, temporary, **options)


def read_large(path: Path, cases: Sequence[str]) -> Numbers:
    """The numbers of such a file, read when they are asked for. Raises BenchError, FileError."""
    try:
        file = parquet().ParquetFile(path, page_checksum_verification=True)
    except (OSError, ValueError) as error:
        raise FileError(path, f"cannot be read as Parquet ({error}); run the method again") from error
    if file.metadata.num_rows != len(cases):
        problem = f"has {file.metadata.num_rows} rows, and the case list beside it lists {len(cases)} cases"
        raise FileError(path, f"{problem}; run the method again")
    names: dict[Key, str] = {}
    for name in file.schema_arrow.names[1:]:
        value, _, index = name.partition(":")
        names[value, index] = name

    def read(key: Key) -> np.ndarray:
        try:
            return np.asarray(file.read(columns=[names[key]]).column(names[key]), float)
        except (OSError, ValueError) as error:
            raise FileError(path, f"cannot be read ({error}); run the method again") from error

    return Lazy(names, read)
