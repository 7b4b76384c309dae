"""All methods on one split side by side: for every value an array over methods and cases."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.api import INTRA, SELF, CaseInfo
from retarget_bench.results import compatibility, dataset_names, store
from retarget_bench.results.compatibility import Newest
from retarget_bench.results.header import Counts, DeclaredValue, ResultHeader
from retarget_bench.results.rows import Key, Numbers, derived
from retarget_bench.results.store import ResultPaths, Results

Run = tuple[Results, Numbers]
"""Results under one seed, and their columns over the cases of a matrix."""


@dataclass(frozen=True)
class MethodRow:
    """One method: its header, and its numbers for every seed that it was run with.

    header: of the first seed, with the counts, problems and faults of all.
    all_paths: of the results, per seed.
    runs:   per seed (value id, index) -> ``(cases,)``.
    """

    label: str
    header: ResultHeader
    all_paths: tuple[ResultPaths, ...]
    runs: tuple[Numbers, ...]

    @property
    def paths(self) -> ResultPaths:
        return self.all_paths[0]

    def number(self, key: Key) -> np.ndarray | None:
        """``(cases,)``: the mean over seeds, nan where any seed has none; None where no case has one."""
        if not all(key in run for run in self.runs):
            return None
        if len(self.runs) == 1:
            return self.runs[0][key]
        return np.mean([run[key] for run in self.runs], axis=0)


@dataclass(frozen=True)
class ResultMatrix:
    """All methods on one split of one data set.

    cases:  sorted by clip. Values of legacy protocols count self pairs as intra, so self cases are there
            too, with those values only; ``own`` tells them apart.
    meaning: what the cases of the split have in common; "" where results do not say it.
    part:   which group of the cases (or joints) this is; "" for all.
    bodies: the group of bodies that all cases are of; "" where they are not told apart.
    variants: labels of the variants of methods that were left out.
    so_far: how many cases these are of those that are asked for, ``3 of 12 clips so far``; "" where
            results are complete.
    own:    ``(cases,)`` bool.
    values: value id -> what headers declare of it.
    """

    dataset: str
    split: str
    cases: tuple[CaseInfo, ...]
    own: np.ndarray
    rows: tuple[MethodRow, ...]
    values: Mapping[str, DeclaredValue]
    meaning: str = ""
    part: str = ""
    bodies: str = ""
    variants: tuple[str, ...] = ()
    so_far: str = ""

    @cached_property
    def clips(self) -> np.ndarray:
        """``(cases,)`` the number of every case's clip, increasing."""
        names = np.array([info.clip for info in self.cases])
        return np.cumsum(np.concatenate([[False], names[1:] != names[:-1]])) if len(names) else names

    @cached_property
    def targets(self) -> frozenset[str]:
        return frozenset(info.target for info in self.cases)

    @cached_property
    def keys(self) -> list[Key]:
        """Every value, and point of a curve, that any method has."""
        return list(dict.fromkeys(key for row in self.rows for run in row.runs for key in run))

    def numbers(self, key: Key) -> np.ndarray:
        """``(methods, cases)``; nan where there is none."""
        nothing = np.full(len(self.cases), np.nan)
        columns = (row.number(key) for row in self.rows)
        return np.array([nothing if each is None else each for each in columns])

    def restricted(self, kept: np.ndarray, part: str) -> ResultMatrix:
        """The matrix of some cases: ``kept`` is ``(cases,)`` bool, or ``(methods, cases)`` where methods
        keep different ones."""
        each = np.array(np.broadcast_to(kept, (len(self.rows), len(self.cases))))
        some: np.ndarray = np.logical_or.reduce(each, axis=0)
        rows = []
        for row, keep in zip(self.rows, each, strict=True):
            counted = self._counted(row.header, keep & self.own)
            kept_runs = (derived(run, partial(_kept, run, keep, some)) for run in row.runs)
            runs = row.runs if keep.all() else tuple(kept_runs)
            rows.append(replace(row, header=counted, runs=runs))
        cases = self.cases if some.all() else tuple(compress(self.cases, some.tolist()))
        return replace(self, cases=cases, own=self.own[some], rows=tuple(rows), part=part)

    def _counted(self, header: ResultHeader, counted: np.ndarray) -> ResultHeader:
        """The header with the counts, problems and faults of some cases; counted: ``(cases,)`` bool."""
        if not (header.problems or header.faults or header.doubts):
            number = int(counted.sum())
            return replace(header, counts=Counts(asked=number, ok=number))
        return header.counted({info.id for info in compress(self.cases, counted.tolist())})

    def narrowed(self, value: str) -> ResultMatrix:
        """The matrix with one value, that by which it is doubted, and nothing else."""
        values = {value: self.values[value]} if value in self.values else {}
        kept = {value, *(each.doubt for each in values.values())} & {value, *self.values}
        rows = []
        for row in self.rows:
            keys = [[key for key in run if key[0] in kept] for run in row.runs]
            runs = (derived(run, run.__getitem__, some) for run, some in zip(row.runs, keys, strict=True))
            rows.append(replace(row, runs=tuple(runs)))
        values = {key: self.values[key] for key in self.values if key in kept}
        return replace(self, rows=tuple(rows), values=values)


def _kept(run: Numbers, keep: np.ndarray, some: np.ndarray, key: Key) -> np.ndarray:
    return np.where(keep, run[key], np.nan)[some]


def result_matrices(results: Iterable[ResultPaths]) -> list[ResultMatrix]:
    """Results by data set and split, in the order of the data set.

    Data sets of one label in several folders are told apart (``dataset_names``). Numbers on other data, or
    of another version of a metric, than the newest of a data set's results are left out, and so are further
    seeds of a method that another version of it ran with, or on other data. Results that are named twice
    count once.
    """
    once: dict[Path, ResultPaths] = {}
    for paths in results:
        once.setdefault(paths.header.resolve(), paths)
    there = dataset_names.headers(once.values())
    names = dataset_names.shown(there)
    newest = {
        name: compatibility.newest(there[paths] for paths in there if names[paths] == name)
        for name in set(names.values())
    }
    grouped: dict[tuple[str, str, str], list[Results]] = {}
    for paths, header in there.items():
        fresh = _fresh(paths, header, newest[names[paths]])
        grouped.setdefault((names[paths], paths.task, paths.split), []).append(fresh)
    return [
        _matrix(of_split, key[0], grouped.get((*key[:2], SELF), []))
        for key, of_split in sorted(grouped.items(), key=lambda each: (*each[0][:2], _place(each[1])))
    ]


def _fresh(paths: ResultPaths, header: ResultHeader, newest: Newest) -> Results:
    """The results with the numbers that may stand beside the newest ones."""
    if newest.why_outdated(header):  # the case list beside the rows is that of the newer data
        return Results(paths, header, (), {})
    stored = store.read_results(paths, header)
    numbers = stored.numbers
    stale = {value for value, _ in numbers if newest.why_value_outdated(header, value)}
    fresh = [key for key in numbers if key[0] not in stale]
    return replace(stored, numbers=derived(numbers, numbers.__getitem__, fresh))


def _place(results: Sequence[Results]) -> tuple[int, str]:
    """Sort key of the results of a split among those of a data set."""
    splits, split = [*_newest(results).dataset.splits], results[0].paths.split
    return splits.index(split) if split in splits else len(splits), split


def _newest(results: Sequence[Results]) -> ResultHeader:
    return max((each.header for each in results), key=lambda header: header.date)


def _matrix(results: Sequence[Results], name: str, selves: Sequence[Results]) -> ResultMatrix:
    values: dict[str, DeclaredValue] = {}
    for each in sorted(results, key=lambda each: each.header.date):
        values |= each.header.values
    pooled = {key for key, value in values.items() if value.with_self}
    split = results[0].paths.split
    extra = selves if pooled and split == INTRA else ()
    lists = {id(each.infos): each.infos for each in (*extra, *results)}  # mostly one
    infos = {info.id: info for each in lists.values() for info in each}
    own = {info.id for each in results for info in each.infos}
    cases = tuple(sorted(infos.values(), key=lambda info: (info.clip, info.id)))
    position = {info.id: at for at, info in enumerate(cases)}
    places = {key: np.array([position[info.id] for info in each], int) for key, each in lists.items()}
    own_self = {replace(each.paths, split=split): each for each in extra}
    runs = [
        (each, _aligned(each, own_self.get(each.paths), pooled, places, len(cases))) for each in results
    ]
    return ResultMatrix(
        dataset=name,
        split=split,
        cases=cases,
        own=np.array([info.id in own for info in cases], dtype=bool),
        rows=_rows(runs),
        values=values,
        meaning=_newest(results).dataset.splits.get(split, ""),
    )


def _aligned(
    results: Results,
    own_self: Results | None,
    pooled: set[str],
    places: Mapping[int, np.ndarray],
    size: int,
) -> Numbers:
    """The columns over all ``size`` cases. Values that pool self pairs need those, or are left out.

    places: id of a case list -> ``(its cases,)`` their places among all.
    """
    there: Numbers = own_self.numbers if own_self is not None else {}

    def over_all(key: Key) -> np.ndarray:
        column = np.full(size, np.nan)
        column[places[id(results.infos)]] = results.numbers[key]
        if own_self is not None and key[0] in pooled and key in there:
            column[places[id(own_self.infos)]] = there[key]
        return column

    apart = results.paths.split != INTRA
    keys = [key for key in results.numbers if apart or key[0] not in pooled or key in there]
    return derived(results.numbers, over_all, keys)


# ----------------------------------------------------------------------------------------------- seeds
def _rows(runs: Sequence[Run]) -> tuple[MethodRow, ...]:
    """One row per method: results under several seeds together. Equal labels of several roots are told
    apart by their folders."""
    grouped: dict[tuple[str, str], list[Run]] = {}
    for results, numbers in runs:
        label = results.header.method.label
        grouped.setdefault((label, str(results.paths.root)), []).append((results, numbers))
    labels = [label for label, _ in grouped]
    rows = []
    for (label, root), each in grouped.items():
        # results on other data than the newest have no cases here
        each.sort(key=lambda pair: (not pair[0].infos, pair[0].header.seeds or (0,)))
        first = each[0][0]
        each = [pair for pair in each if _version(pair[0].header) == _version(first.header)]
        named = first.header.method.shown
        shown = named if labels.count(label) == 1 else f"{named} ({root})"
        seeds = tuple(numbers for _, numbers in each)
        all_paths = tuple(results.paths for results, _ in each)
        rows.append(MethodRow(shown, _header([results for results, _ in each]), all_paths, seeds))
    return tuple(rows)


def _header(of_seeds: Sequence[Results]) -> ResultHeader:
    """One header for the results under several seeds: a case is answered where every seed answered it."""
    first = of_seeds[0].header
    if len(of_seeds) == 1:
        return first
    problems = tuple(problem for each in of_seeds for problem in each.header.problems)
    faults = tuple(fault for each in of_seeds for fault in each.header.faults)
    doubts = tuple(doubt for each in of_seeds for doubt in each.header.doubts)
    seeds = tuple(seed for each in of_seeds for seed in each.header.seeds)
    ids = {info.id for info in of_seeds[0].infos}
    return replace(first, problems=problems, faults=faults, doubts=doubts, seeds=seeds).counted(ids)


def _version(header: ResultHeader) -> tuple[Any, ...]:
    """Results under several seeds stand together where this is equal."""
    return header.dataset.content, header.method, header.metrics


def set_values(headers: Iterable[ResultHeader]) -> dict[str, DeclaredValue]:
    """Value id -> its declaration in the newest header, for all values of sets."""
    headers = sorted(headers, key=lambda header: header.date)
    return {key: value for each in headers for key, value in each.set_values.items()}
