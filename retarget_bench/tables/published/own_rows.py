"""Our methods in the columns of a published table, over the cases that all of them answered."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from retarget_bench import defaults
from retarget_bench.analysis.summary import common_cases, means_over_clips, never_ranked
from retarget_bench.api import SELF, CaseInfo
from retarget_bench.results import case_metadata, metres
from retarget_bench.results.header import MethodInfo
from retarget_bench.results.result_matrix import ResultMatrix
from retarget_bench.tables.model import count
from retarget_bench.tables.published.own import Counts, OwnCell, OwnRow, OwnRows, variant
from retarget_bench.tables.published.published_tables import PublishedColumn, PublishedTable

UNTRAINED = "the method is untrained, so no structure is seen or unseen"
NO_SELF = "counts self pairs, too, and there are no results on the self split"


def own_rows(table: PublishedTable, matrices: Sequence[ResultMatrix]) -> list[OwnRows]:
    """Rows of the methods that have a number in any column, per data set and group of bodies.

    matrices: of any splits, of bodies told apart. A number of a column is over the cases that all compared
    methods have one for (see ``common_cases``); a method that did not answer one that the column asks for,
    or lacks too many numbers, is over its own, and the best of the others stands beside it, over the same.
    """
    grouped: dict[tuple[str, str], list[ResultMatrix]] = {}
    for matrix in matrices:
        grouped.setdefault((matrix.dataset, matrix.bodies), []).append(matrix)
    found = [
        OwnRows(*which, *_Compared.of(table, _Pool.of(each)).rows()) for which, each in grouped.items()
    ]
    return [part for part in found if part.rows]


@dataclass(frozen=True)
class _Pool:
    """All cases of all splits, sorted by clip, and the methods that have results on any split.

    clips: ``(cases,)``, see ``statistics.per_clip``. structures: ``(cases,)`` of the targets, or "".
    spots: per matrix the methods' and the cases' numbers here, and which of its cases these are.
    """

    matrices: Sequence[ResultMatrix]
    methods: Mapping[str, MethodInfo]
    infos: tuple[CaseInfo, ...]
    clips: np.ndarray
    structures: tuple[str, ...]
    spots: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]

    @classmethod
    def of(cls, matrices: Sequence[ResultMatrix]) -> "_Pool":
        rows = [row for matrix in matrices for row in matrix.rows]
        methods = {row.label: row.header.method for row in sorted(rows, key=lambda row: row.label)}
        own = [np.flatnonzero(matrix.own) for matrix in matrices]
        there = {_key(m.cases[i]): m.cases[i] for m, at in zip(matrices, own, strict=True) for i in at}
        infos = sorted(there.values(), key=lambda info: (info.clip, *_key(info)))
        place = {_key(info): number for number, info in enumerate(infos)}
        labels = list(methods)
        known: dict[str, str] = {}
        for row in rows:
            known |= case_metadata.read_structures(row.paths) or {}
        return cls(
            matrices=matrices,
            methods=methods,
            infos=tuple(infos),
            clips=np.unique([info.clip for info in infos], return_inverse=True)[1],
            structures=tuple(known.get(info.target, "") for info in infos),
            spots=[
                (
                    np.array([labels.index(row.label) for row in matrix.rows], dtype=int),
                    np.array([place[_key(matrix.cases[i])] for i in at], dtype=int),
                    at,
                )
                for matrix, at in zip(matrices, own, strict=True)
            ],
        )

    def numbers(self, column: PublishedColumn) -> np.ndarray:
        """``(methods, cases)`` of a column's value, in metres where the column is; nan where there is none.

        Raises BenchError where metres are asked for and results do not say how tall their targets are.
        """
        found = np.full((len(self.methods), len(self.infos)), np.nan)
        for matrix, (rows, columns, own) in zip(self.matrices, self.spots, strict=True):
            declared = matrix.values.get(column.value)
            if declared is not None and metres.UNITS.get(declared.unit) == column.unit:
                matrix = metres.in_metres(matrix)
            found[np.ix_(rows, columns)] = matrix.numbers((column.value, ""))[:, own]
        return found

    def unanswered(self) -> np.ndarray:
        """``(methods, cases)`` bool: the cases that a method did not answer, of the splits that it has."""
        found = np.zeros((len(self.methods), len(self.infos)), dtype=bool)
        for matrix, (rows, columns, own) in zip(self.matrices, self.spots, strict=True):
            for row, at in zip(matrix.rows, rows, strict=True):
                lost = row.header.unanswered
                found[at, columns] = [matrix.cases[case].id in lost for case in own]
        return found

    @property
    def pooled(self) -> set[str]:
        """Values that count self pairs as intra, which therefore need results on both."""
        return {key for matrix in self.matrices for key, value in matrix.values.items() if value.with_self}

    @property
    def with_self(self) -> set[str]:
        """Methods with results on the self split."""
        return {row.label for matrix in self.matrices if matrix.split == SELF for row in matrix.rows}

    def counts(self, there: np.ndarray) -> Counts:
        """there: ``(cases,)`` bool."""
        pairs = {self.infos[at].pair for at in np.flatnonzero(there)}
        return Counts(int(there.sum()), len(np.unique(self.clips[there])), len(pairs))

    @property
    def of_papers(self) -> bool:
        """True for the data set that the papers' pairs are of."""
        name = self.matrices[0].rows[0].header.dataset.name
        return name == defaults.PAPERS_DATASET


@dataclass(frozen=True)
class _Column:
    """The numbers of one column.

    answered: ``(methods, cases)``, nan where a method has none, or the column does not ask for the case.
    numbers:  the same, of compared methods and controls over the common cases alone.
    alike:    ``(methods,)`` bool: over the common cases.
    common:   ``(cases,)`` bool; none where methods have cases of their own.
    own:      how the cases differ from method to method, or "".
    """

    answered: np.ndarray
    numbers: np.ndarray
    alike: np.ndarray
    common: np.ndarray
    own: str = ""


@dataclass(frozen=True)
class _Compared:
    """The columns of a table that methods have numbers for."""

    table: PublishedTable
    pool: _Pool
    columns: Mapping[str, _Column]

    @classmethod
    def of(cls, table: PublishedTable, pool: _Pool) -> "_Compared":
        asked = [each for each in table.columns if each.value and _takes(each, pool)]
        columns = {each.id: _compared(each, pool) for each in asked}
        columns = {key: each for key, each in columns.items() if not np.isnan(each.answered).all()}
        for each in table.columns:
            if parts := [columns[part] for part in each.mean_of if part in columns]:
                columns[each.id] = _together(parts)
        return cls(table, pool, columns)

    def rows(self) -> tuple[tuple[OwnRow, ...], dict[str, Counts]]:
        """The rows by name, and the common cases of every column."""
        rows: list[OwnRow] = []
        for at, label in enumerate(self.pool.methods):
            row = self._row(at, label)
            rows += [row] if row.cells else []
            if not row.mark and not all(cell.common for cell in row.cells.values()):
                rows += self._beside(at, label)
        common = {
            key: self.pool.counts(each.common) for key, each in self.columns.items() if each.common.any()
        }
        return tuple(rows), common

    def _row(self, at: int, label: str) -> OwnRow:
        method = self.pool.methods[label]
        mark = never_ranked(method)
        cells = self._cells({key: each.numbers[at] for key, each in self.columns.items()})
        for key, cell in cells.items():
            column = self.columns[key]
            common = bool(mark) or bool(column.own) or bool(column.alike[at])
            cells[key] = replace(cell, common=common, note=self._note(column, cell, common))
        return OwnRow(label, mark, cells, self._reasons(label), variant(method))

    def _reasons(self, label: str) -> dict[str, str]:
        """Column -> why a method has no number there, where that is another reason than usual."""
        reasons = {}
        pooled = self.pool.pooled if label not in self.pool.with_self else ()
        for column in self.table.columns:
            if column.seen and not self.pool.methods[label].trained_on:
                reasons[column.id] = UNTRAINED
            elif column.value in pooled and _with_self(column) and _takes(column, self.pool):
                reasons[column.id] = NO_SELF
        return reasons

    def _note(self, column: _Column, cell: OwnCell, common: bool) -> str:
        """How a number that is not set apart is over other cases than others of its column, or ""."""
        if column.own:
            return f"over {count(cell.over.cases, 'case')}: {column.own}"
        asked = int(column.common.sum())
        if common and asked and cell.over.cases < asked:
            return f"over the {cell.over.cases} of the {count(asked, 'common case')} that it has"
        return ""

    def _beside(self, at: int, label: str) -> list[OwnRow]:
        """The best of the compared methods, over the cases that a method answered, in every column."""
        compared = np.array([not never_ranked(each) for each in self.pool.methods.values()])
        answered = [each for each in self.columns.values() if not np.isnan(each.answered[at]).all()]
        last = next((each for each in reversed(answered) if (each.alike & compared).any()), None)
        if last is None:
            return []
        means = means_over_clips(last.numbers, self.pool.clips)
        others = np.flatnonzero(last.alike & compared)
        best = min(others, key=lambda n: mean.value if (mean := means[n]) else np.inf)
        shared = {
            key: np.where(np.isnan(each.answered[at]), np.nan, each.answered[best])
            for key, each in self.columns.items()
        }
        cells = {key: replace(cell, common=False) for key, cell in self._cells(shared).items()}
        labels = list(self.pool.methods)
        return [OwnRow(labels[best], "", cells, beside=label)] if cells else []

    def _cells(self, numbers: Mapping[str, np.ndarray]) -> dict[str, OwnCell]:
        """The cells of one method. numbers: column -> ``(cases,)``."""
        cells: dict[str, OwnCell] = {}
        for column in self.table.columns:
            mine = numbers.get(column.id)
            if mine is None or np.isnan(mine).all():
                continue
            (mean,) = means_over_clips(mine[None], self.pool.clips)
            assert mean is not None
            value = mean.value
            if column.mean_of:  # the mean of means, as the papers take it
                value = float(np.mean([cells[part].value for part in column.mean_of if part in cells]))
            over = self.pool.counts(~np.isnan(mine))
            cells[column.id] = OwnCell(value, float(np.nanstd(mine)), over)
        return cells


def _key(info: CaseInfo) -> tuple[str, str]:
    return info.split, info.id


def _with_self(column: PublishedColumn) -> bool:
    """True for columns that self pairs count in."""
    ends = [pair.split(">") for pair in column.pairs]
    return SELF in column.splits or any(source == target for source, target in ends)


def _takes(column: PublishedColumn, pool: _Pool) -> bool:
    """True for columns that these data can be of."""
    anywhere = column.any_pair or column.splits or column.seen or column.structure
    return bool(anywhere) or pool.of_papers


def _compared(column: PublishedColumn, pool: _Pool) -> _Column:
    asked = np.array(
        [[_asked(column, pool, n, each) for n in range(len(pool.infos))] for each in _who(column, pool)]
    )
    answered = np.where(asked, pool.numbers(column), np.nan)
    compared = np.array([not never_ranked(each) for each in pool.methods.values()])
    having = compared & ~np.isnan(answered).all(axis=1)
    if column.seen and len(np.unique(asked[having], axis=0)) > 1:
        own = f"bodies of structures that its own training {'had' if column.seen == 'seen' else 'had not'}"
        nothing = np.zeros_like(answered, dtype=bool)
        return _Column(answered, answered, nothing[:, 0], nothing[0], own)
    common, among, _ = common_cases(answered, having & ~(asked & pool.unanswered()).any(axis=1))
    if not among.any():
        return _Column(answered, answered, among, np.zeros_like(common))
    over = among | ~compared
    numbers = np.where(over[:, None] & ~common, np.nan, answered)
    return _Column(answered, numbers, over, common)


def _who(column: PublishedColumn, pool: _Pool) -> list[MethodInfo | None]:
    """The methods that a column asks for different cases; else one for all."""
    return list(pool.methods.values()) if column.seen else [None]


def _asked(column: PublishedColumn, pool: _Pool, case: int, method: MethodInfo | None) -> bool:
    """True if the number of a case belongs to a column."""
    info, structure = pool.infos[case], pool.structures[case]
    if column.structure:
        return structure == column.structure
    if column.seen:
        trained = method.trained_on if method else None
        had = trained is not None and structure in trained.get("structures", ())
        return trained is not None and had == (column.seen == "seen")
    if column.splits:
        return info.split in column.splits
    return info.split != SELF if column.any_pair else info.pair in column.pairs


def _together(parts: Sequence[_Column]) -> _Column:
    """Columns of different cases as one. A method that lacks one of them is not over the common cases."""

    def merged(arrays: Sequence[np.ndarray]) -> np.ndarray:
        found = arrays[0]
        for each in arrays[1:]:
            found = np.where(np.isnan(found), each, found)
        return found

    def whole(part: _Column) -> np.ndarray:
        return part.alike & ~np.isnan(part.numbers).all(axis=1)

    compared = [part for part in parts if part.common.any()]
    nobody = np.zeros(len(parts[0].alike), dtype=bool)
    return _Column(
        answered=merged([part.answered for part in parts]),
        numbers=merged([part.numbers for part in parts]),
        alike=np.logical_and.reduce([whole(part) for part in compared]) if compared else nobody,
        common=np.logical_or.reduce([part.common for part in parts]),
    )
