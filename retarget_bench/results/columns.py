"""Rows read as columns: for every value an array over the case list.

Tables and comparisons of thousands of cases read millions of rows. Where files are large, pandas' reader
takes them; small ones, and any that it refuses, are read line by line, so that an error names its line. Of
results of many cases (``large_rows``) columns are read when they are asked for, and not kept.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.api import CaseInfo
from retarget_bench.errors import FileError
from retarget_bench.results import store
from retarget_bench.results.compatibility import Newest
from retarget_bench.results.header import ResultHeader
from retarget_bench.results.large_rows import LargeRows
from retarget_bench.results.paths import CASES, ROWS, SETS, CaseResult, ResultPaths
from retarget_bench.results.paths import LARGE as LARGE_ROWS

LARGE = 1_000_000
"""Bytes from which importing pandas pays."""

Key = tuple[str, str]
"""A value's id and the index of a point of its curve, or ""."""
Numbers = Mapping[Key, np.ndarray]


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
    found = Lazy(source if keys is None else keys, make)
    return found if isinstance(source, Lazy) else dict(found)


@dataclass(frozen=True)
class Columns:
    """The numbers of one method on one split.

    cases:   in the order of the case list.
    numbers: (value id, index or "") -> ``(cases,)``, nan where a case has no such number.
    """

    paths: ResultPaths
    header: ResultHeader
    cases: tuple[CaseInfo, ...]
    numbers: Numbers


def read(paths: ResultPaths, header: ResultHeader, newest: Newest) -> Columns:
    """The rows and case list of a result: the numbers that may stand beside the newest results.

    Raises FileError when a file is missing, damaged or from a newer version.
    """
    if newest.why_outdated(header):  # the case list beside the rows is that of the newer data
        return Columns(paths, header, (), {})
    store.verify(paths, header, ROWS, LARGE_ROWS, CASES, SETS)
    cases = _cases(paths.cases, paths.task, paths.split, paths.cases.stat().st_mtime_ns)
    if LARGE_ROWS in header.files:
        rows = LargeRows(paths.large)
        if len(rows) != len(cases):
            told = f"has {len(rows)} rows, and {paths.cases} lists {len(cases)} cases; run the method again"
            raise FileError(paths.large, told)
        fresh = [key for key in rows.keys() if not newest.why_value_outdated(header, key[0])]  # noqa: SIM118
        return Columns(paths, header, cases, Lazy(fresh, rows.column))
    position = {info.id: number for number, info in enumerate(cases)}
    if paths.complete:
        large = paths.rows.exists() and paths.rows.stat().st_size >= LARGE
        found = _fast(paths, position) if large else None
        numbers = _slow(paths, position, store.read_rows(paths.rows)) if found is None else found
    else:
        header, entries = store.read_begun(paths, header, cases)
        numbers = _slow(paths, position, entries)
    stale = {value for value, _ in numbers if newest.why_value_outdated(header, value)}
    return Columns(paths, header, cases, {key: numbers[key] for key in numbers if key[0] not in stale})


@lru_cache(maxsize=8)
def _cases(path: Path, task: str, split: str, changed: int) -> tuple[CaseInfo, ...]:
    """A case list, which all methods on a split share."""
    del changed
    return (_fast_cases(path, task, split) if path.stat().st_size >= LARGE else None) or tuple(
        store.read_cases(path, task, split)
    )


def _fast_cases(path: Path, task: str, split: str) -> tuple[CaseInfo, ...] | None:
    """The same by pandas, where names that recur are one object; None where anything is odd."""
    import pandas as pd

    types = {"case": "object", "frames": "int64"}
    text = dict.fromkeys(store.CASE_FIELDS, "category") | types
    try:
        rows = pd.read_csv(path, dtype=text, na_filter=False, encoding="utf-8")
    except (OSError, ValueError):
        return None
    if tuple(rows.columns) != store.CASE_FIELDS or (rows["frames"] < 0).any() or not rows["case"].is_unique:
        return None
    case, *names, frames = (rows[name].astype(object).tolist() for name in store.CASE_FIELDS)
    return tuple(map(CaseInfo, case, repeat(task), repeat(split), *names, frames))


def _slow(
    paths: ResultPaths, position: dict[str, int], entries: Mapping[str, CaseResult]
) -> dict[Key, np.ndarray]:
    numbers: dict[Key, np.ndarray] = {}
    for case, entry in entries.items():
        if case not in position:
            raise FileError(paths.rows, f"names case {case!r}, which {paths.cases} does not list")
        for value_id, value in entry.values.items():
            for index, number in value.items() if isinstance(value, dict) else (("", value),):
                key = value_id, index
                if key not in numbers:
                    numbers[key] = np.full(len(position), np.nan)
                numbers[key][position[case]] = number
    return numbers


def _fast(paths: ResultPaths, position: dict[str, int]) -> dict[Key, np.ndarray] | None:
    """The same by pandas; None where anything is not as it should be."""
    import pandas as pd

    # exact by default since 3.1, where asking for it is deprecated
    old = tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1)
    exact: dict[str, Any] = {"float_precision": "round_trip"} if old else {}
    text = dict.fromkeys(store.ROW_FIELDS[:3], "category")
    try:
        rows = pd.read_csv(
            paths.rows,
            dtype=text | {"value": "float64"},
            na_filter=False,
            **exact,
            encoding="utf-8",
        )
    except (OSError, ValueError):
        return None
    if tuple(rows.columns) != store.ROW_FIELDS or not np.isfinite(rows["value"]).all():
        return None
    names = {name: list(rows[name].cat.categories) for name in store.ROW_FIELDS[:3]}
    codes = {name: rows[name].cat.codes.to_numpy().astype(np.int64) for name in names}
    if not all(case in position for case in names["case"]):
        return None
    at = np.array([position[case] for case in names["case"]])[codes["case"]]
    pairs, key = np.unique(codes["value_id"] * len(names["index"]) + codes["index"], return_inverse=True)
    table = np.full((len(pairs), len(position)), np.nan)
    table[key, at] = rows["value"].to_numpy()
    value_of, index_of = np.divmod(pairs, len(names["index"]))
    keys = [(names["value_id"][v], names["index"][i]) for v, i in zip(value_of, index_of, strict=True)]
    both = {v for v, i in keys if i} & {v for v, i in keys if not i}
    twice = len(rows) - np.count_nonzero(~np.isnan(table))
    return None if both or twice else dict(zip(keys, table, strict=True))
