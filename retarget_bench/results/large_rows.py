"""Rows of many cases as Parquet: a row per case in the order of the case list, a column per value.

A value with an index is a map from the index to a number. Tables read the few columns that they show, and
text would have to be read whole. Numbers have nine significant digits, as in text. Pages carry checksums,
which are compared as they are read.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import atomic
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.paths import ARRAY_INDICES, CaseResult

MANY = 20_000
"""Results of more cases are stored in this form."""
BATCH = 20_000
"""Cases that are written together."""

Batch = tuple[Sequence[str], Mapping[str, Sequence[Any] | np.ndarray]]
"""Cases; value id -> for each a number, nan or None; of a value with an index ``(index, number)`` pairs."""
Key = tuple[str, str]
KEYS = "keys"
"""The name of the file's list of these."""


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


def batches(entries: Iterable[CaseResult], declared: Mapping[str, DeclaredValue]) -> Iterator[Batch]:
    """Entries, in the order of the case list, as they are written."""
    waiting = iter(entries)
    while some := list(islice(waiting, BATCH)):
        columns = {key: [_rounded(entry.values.get(key)) for entry in some] for key in declared}
        yield [entry.case for entry in some], columns


def _rounded(value: float | dict[str, float] | None) -> Any:
    if isinstance(value, dict):
        return [(index, float(f"{number:.9g}")) for index, number in value.items()]
    return None if value is None else float(f"{value:.9g}")


def write(path: Path, found: Iterable[Batch], declared: Mapping[str, DeclaredValue]) -> int:
    """Write batches of values, atomically; returns the number of cases. Raises BenchError, FileError."""
    module = parquet()
    import pyarrow as pa

    number, curve = pa.float64(), pa.map_(pa.string(), pa.float64())
    numbers = {key: curve if value.index else number for key, value in declared.items()}
    schema = pa.schema({"case": pa.string(), **numbers})
    # what any case has a number of, so that readers know it without reading the columns
    keys = set[Key]()
    options = {"compression": "zstd", "use_dictionary": False, "write_page_checksum": True}
    count = 0
    with atomic(path) as temporary, module.ParquetWriter(temporary, schema, **options) as writer:
        for cases, columns in found:
            nothing = [None] * len(cases)
            arrays = [pa.array(columns.get(k, nothing), numbers[k], from_pandas=True) for k in numbers]
            for key, array in zip(numbers, arrays, strict=True):
                if not declared[key].index and array.null_count < len(array):
                    keys.add((key, ""))
                elif declared[key].index not in ("", *ARRAY_INDICES):
                    keys |= {(key, point) for point in array.keys.unique().to_pylist()}
            writer.write_table(pa.Table.from_arrays([pa.array(cases, pa.string()), *arrays], schema=schema))
            count += len(cases)
        ordered = sorted(keys, key=lambda key: (list(numbers).index(key[0]), key[1]))
        writer.add_key_value_metadata({KEYS: json.dumps(ordered)})
    return count


class LargeRows:
    """A file of such rows, of which columns are read when they are asked for. Raises FileError."""

    def __init__(self, path: Path) -> None:
        self.path = path
        module = parquet()
        try:
            self.file = module.ParquetFile(path, page_checksum_verification=True)
        except (OSError, ValueError) as error:
            raise FileError(path, f"cannot be read as Parquet ({error}); run the method again") from error
        if KEYS.encode() not in (self.file.metadata.metadata or {}):
            raise FileError(path, "does not say what it holds numbers of; run the method again")

    def __len__(self) -> int:
        return int(self.file.metadata.num_rows)

    def keys(self) -> list[Key]:
        """Every value that any case has, and every point of its curve; none per joint or frame."""
        return [(value, point) for value, point in json.loads(self.file.metadata.metadata[KEYS.encode()])]

    def column(self, key: Key) -> np.ndarray:
        """``(cases,)``: nan where a case has no such number."""
        value, point = key
        found = self._read(value)
        if not point:
            return found.to_numpy()
        numbers = np.full(len(self), np.nan)
        start = 0
        for chunk in found.chunks:
            case, index, items = _pairs(chunk)
            there = np.asarray(index.to_numpy(zero_copy_only=False) == point)
            numbers[start + case[there]] = items[there]
            start += len(chunk)
        return numbers

    def pairs(self, value: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of a value with an index, for every number its case, its index, and the number."""
        table = self._read("case").to_numpy()
        found, start = [], 0
        for chunk in self._read(value).chunks:
            case, index, items = _pairs(chunk)
            found.append((table[start + case], index.to_numpy(zero_copy_only=False), items))
            start += len(chunk)
        cases, indices, numbers = (np.concatenate(each) for each in zip(*found, strict=True))
        return cases.astype(str), indices.astype(str), numbers

    def per_index(self) -> list[str]:
        """The values per joint or frame."""
        curves = {value for value, _ in self.keys()}
        columns = (each for each in self.file.schema_arrow if str(each.type).startswith("map"))
        return [each.name for each in columns if each.name not in curves]

    def entries(self) -> dict[str, CaseResult]:
        """Case -> its values, but for those per joint and frame."""
        cases = self._read("case").to_pylist()
        found = {case: CaseResult(case, "ok") for case in cases}
        for value in dict.fromkeys(value for value, _ in self.keys()):
            for case, number in zip(cases, self._read(value).to_pylist(), strict=True):
                if number is not None:
                    found[case].values[value] = dict(number) if isinstance(number, list) else number
        return {case: entry for case, entry in found.items() if entry.values}

    def _read(self, name: str) -> Any:
        try:
            return self.file.read(columns=[name]).column(name)
        except (OSError, ValueError) as error:
            raise FileError(self.path, f"cannot be read ({error}); run the method again") from error


def _pairs(chunk: Any) -> tuple[np.ndarray, Any, np.ndarray]:
    """Of maps, for every pair the place of its map, its index and its number."""
    lengths = np.diff(chunk.offsets.to_numpy())
    return np.repeat(np.arange(len(chunk)), lengths), chunk.keys, chunk.items.to_numpy()
