"""Our results in the columns of a published table, over the cases that all methods answered."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from retarget_bench import defaults
from retarget_bench.analysis.ranking import common_cases, never_ranked
from retarget_bench.analysis.summary import means_over_clips
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import case_metadata, metres
from retarget_bench.results.header import MethodInfo
from retarget_bench.results.result_matrix import ResultMatrix
from retarget_bench.tables.model import NOT_APPLICABLE, Cell, count
from retarget_bench.tables.published.printed import SEEN, STRUCTURE, Column, PublishedTable

FEWER = "answered fewer cases"
UNTRAINED = "the method is untrained, so no structure is seen or unseen"
UNKNOWN = "what the weights were trained on is not known"


@dataclass(frozen=True)
class OurRow:
    """One method on one data set and group of bodies, ``where``: column -> cell, of all columns.

    mark: why a method is not compared, or "". about: see ``about``.
    common: column -> the cases that compared rows are over.
    """

    where: str
    label: str
    mark: str
    cells: Mapping[str, Cell]
    about: str = ""
    common: Mapping[str, int] = field(default_factory=dict)

    @property
    def numbers(self) -> dict[str, Cell]:
        """The cells that have a number."""
        return {label: cell for label, cell in self.cells.items() if cell.value is not None}


def about(method: MethodInfo) -> str:
    """Whose weights a method has, and which ``variant`` of a published one it is."""
    return "; ".join(filter(None, [whose(method), variant(method)]))


def whose(method: MethodInfo) -> str:
    """Whose weights a learned method has: ``authors' weights``, or ``own`` with the part of its paper's
    windows that they have seen, where that is known; "" of an untrained one."""
    if method.is_by_authors:
        return "authors' weights"
    if method.trained_on is None:
        return ""
    share = method.training_share
    return "own weights" if share is None else f"own weights, {share} of its paper's windows"


def variant(method: MethodInfo) -> str:
    """Variant of a published method, by its card: ``as published``, ``ours: ...``, or of a method without a
    paper, what distinguishes it. "" where the label says it, or it is not installed.

    What parameters in the label set is not said again.
    """
    parameters = {name: value for name, value in method.parameters.items() if name != "weights"}
    try:
        card = registry.create("methods", Spec(method.name, parameters)).card
    except BenchError:
        return ""
    words = ", ".join(sentence for name, sentence in card.differs.items() if name not in parameters)
    if not card.paper:
        return words
    if any(parameters == each for each in card.published):
        return "as published"
    return f"ours: {words}" if words else "ours, with these settings" if parameters else "ours"


def number_cell(value: float, spread: float | None, decimals: int) -> Cell:
    """A cell with a number of ours, and with its spread where there is one."""
    text = f"{value:.{decimals}f}" + ("" if spread is None else f" ±{spread:.{decimals}f}")
    return Cell(text, value, decimals=decimals)


def missing(column: Column, why: str = "") -> Cell:
    """A cell without a number of ours. why: of the method, where it is known."""
    return Cell(NOT_APPLICABLE, reason=column.missing or why or f"no results on {column.over}")


def counted(where: str, over: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """A sentence on what columns are over: cases or windows in words -> the columns; () for none."""
    notes = "; ".join(f"{', '.join(columns)}: {cases}" for cases, columns in over.items())
    return (f"n, {where}: {notes}.",) if over else ()


def of_cases(table: PublishedTable, matrices: Sequence[ResultMatrix]) -> tuple[list[OurRow], list[str]]:
    """Rows of the methods that have a number in any column, by data set, group of bodies and name; and
    sentences on what their numbers are over.

    matrices: of any splits, of bodies told apart. A number is a mean over clips of the mean over a clip's
    cases, of those that all compared methods have one for (see ``common_cases``). A method that did not
    answer one that the column asks for, or lacks too many numbers, is over its own; a note has the best of
    the others on the same.
    """
    grouped: dict[str, list[ResultMatrix]] = {}
    for matrix in matrices:
        where = f"{matrix.dataset}: {matrix.bodies}" if matrix.bodies else matrix.dataset
        grouped.setdefault(where, []).append(matrix)
    all_rows: list[OurRow] = []
    notes: list[str] = []
    for where, each in grouped.items():
        rows, counts = _Part(table, each).rows(where)
        all_rows += rows
        notes += counts if rows else []
    return all_rows, notes


@dataclass(frozen=True)
class _Numbers:
    """The numbers of one column, ``(methods, cases)``, nan where there is none or it is over other cases.

    shown:  of compared methods and controls over the common cases alone.
    alike:  ``(methods,)`` bool: compared over the common cases.
    common: ``(cases,)`` bool; none where methods have cases of their own (``own``).
    """

    answered: np.ndarray
    shown: np.ndarray
    alike: np.ndarray
    common: np.ndarray
    own: bool


class _Part:
    """All cases of all splits of a data set, sorted by clip, and the methods with results on any.

    clips: ``(cases,)``, see ``statistics.per_clip``. structures: ``(cases,)`` of the targets, or "".
    compared: ``(methods,)`` bool. numbers: of the columns in which any method has one.
    """

    def __init__(self, table: PublishedTable, matrices: Sequence[ResultMatrix]) -> None:
        self.table, self.matrices = table, matrices
        rows = sorted((row for matrix in matrices for row in matrix.rows), key=lambda row: row.label)
        own = {matrix.cases[i] for matrix in matrices for i in np.flatnonzero(matrix.own)}
        structures = {
            target: each
            for row in rows
            for target, each in case_metadata.read(row.paths).structures.items()
        }
        self.methods = {row.label: row.header.method for row in rows}
        self.infos = sorted(own, key=lambda info: (info.clip, info.split, info.id))
        self.clips = np.unique([info.clip for info in self.infos], return_inverse=True)[1]
        self.structures = [structures.get(info.target, "") for info in self.infos]
        self.compared = np.array([not never_ranked(each) for each in self.methods.values()])
        numbers = {column.label: self._numbers(column) for column in table.columns if column.value_id}
        self.numbers = {label: each for label, each in numbers.items() if not np.isnan(each.answered).all()}

    def rows(self, where: str) -> tuple[list[OurRow], list[str]]:
        """The rows by name, and sentences on what their numbers are over."""
        rows = [self._row(at, where, *each) for at, each in enumerate(self.methods.items())]
        fewer = [self._on_the_same(at, row.label) for at, row in enumerate(rows) if row.mark == FEWER]
        common = {
            label: int(each.common.sum()) for label, each in self.numbers.items() if each.common.any()
        }
        shown = [replace(row, common=common) for row in rows if row.numbers]
        return shown, [*self._counts(where), *filter(None, fewer)]

    # ------------------------------------------------------------------------------------------ numbers
    def _numbers(self, column: Column) -> _Numbers:
        """The numbers of a column."""
        over = np.array([self._cases_of(column, each) for each in self.methods.values()])
        answered, unanswered = np.full(over.shape, np.nan), np.zeros_like(over)
        method = {label: number for number, label in enumerate(self.methods)}
        case = {info: number for number, info in enumerate(self.infos)}
        for matrix in self.matrices:
            declared = matrix.values.get(column.value_id)
            if declared is not None and metres.UNITS.get(declared.unit) == column.unit:
                matrix = metres.in_metres(matrix)
            own = np.flatnonzero(matrix.own)
            at = np.ix_([method[row.label] for row in matrix.rows], [case[matrix.cases[i]] for i in own])
            answered[at] = matrix.numbers((column.value_id, ""))[:, own]
            unanswered[at] = [
                [matrix.cases[i].id in row.header.unanswered for i in own] for row in matrix.rows
            ]
        answered[~over] = np.nan
        having = self.compared & ~np.isnan(answered).all(axis=1)
        own_cases = len(np.unique(over[having], axis=0)) > 1
        ranked = having & ~(over & unanswered).any(axis=1)
        if own_cases:
            ranked[:] = False
        shown = answered.copy()
        common, alike, _ = common_cases(shown, ranked, ~self.compared)
        return _Numbers(answered, shown, alike, common, own_cases)

    def _cases_of(self, column: Column, method: MethodInfo) -> np.ndarray:
        """``(cases,)`` bool: the cases that a column is over, of a method."""
        structures = np.array(self.structures)
        if column.chosen_by == "structure":
            return structures == column.cases.removeprefix(f"{STRUCTURE} ")
        if column.chosen_by == "training":
            had = (method.trained_on or {}).get("structures", ())
            matches = np.isin(structures, list(had)) == (column.cases == SEEN)
            return matches & bool(had)
        if column.chosen_by == "splits":
            return np.array([column.takes(info.split) for info in self.infos])
        pairs = column.pairs.union(*(each.pairs for each in self._parts(column)))
        of_papers = self.matrices[0].rows[0].header.dataset.name == defaults.PAPERS_DATASET
        return np.array([of_papers and info.pair in pairs for info in self.infos])

    def _parts(self, column: Column) -> list[Column]:
        """The columns that a column is the mean of."""
        return [each for each in self.table.columns if column.chosen_by == "mean" and each.pairs]

    # --------------------------------------------------------------------------------------------- rows
    def _row(self, at: int, where: str, label: str, method: MethodInfo) -> OurRow:
        mark, fewer = never_ranked(method), False
        having = self._cells({key: found.shown[at] for key, found in self.numbers.items()})
        cells = {}
        for column in self.table.columns:
            if (cell := having.get(column.label)) is None:
                by_training = column.chosen_by == "training"
                why = UNTRAINED if method.trained_on is None else "" if method.trained_on else UNKNOWN
                cells[column.label] = missing(column, why if by_training else "")
                continue
            found, reason = self.numbers[column.label], ""
            common = int(found.common.sum())
            if found.own:
                reason = f"over {count(cell.n, 'case')}: {column.over} of its own"
            elif not (mark or found.alike[at]):
                fewer = True
            elif cell.n < common:
                reason = f"over the {cell.n} of the {count(common, 'common case')} that it has"
            cells[column.label] = replace(cell, reason=reason)
        return OurRow(where, label, mark or (FEWER if fewer else ""), cells, about(method))

    def _cells(self, numbers: Mapping[str, np.ndarray]) -> dict[str, Cell]:
        """The cells with a number of one method. numbers: column -> ``(cases,)``."""
        cells: dict[str, Cell] = {}
        for column in self.table.columns:
            own = numbers.get(column.label, np.full(len(self.infos), np.nan))
            (mean,) = means_over_clips(own[None], self.clips)
            if mean is None:
                continue
            value, interval = mean.value, mean.interval
            if parts := self._parts(column):  # the mean of means, as the papers take it
                values = (cells[part.label].value for part in parts if part.label in cells)
                value, interval = float(np.mean([each for each in values if each is not None])), None
            spread = float(np.nanstd(own)) if self.table.has_spread(column.label) else None
            cell = number_cell(value, spread, self.table.decimals(column.label))
            cells[column.label] = replace(cell, interval=interval, n=mean.n, clips=mean.clips)
        return cells

    # -------------------------------------------------------------------------------------------- notes
    def _on_the_same(self, at: int, label: str) -> str:
        """A sentence with the numbers that the best of the compared methods has on the cases of another; ""
        where there are no others."""
        columns = [each for each in self.numbers.values() if not np.isnan(each.answered[at]).all()]
        last = next((each for each in reversed(columns) if each.alike.any()), None)
        if last is None:
            return ""
        means = means_over_clips(last.shown, self.clips)
        others = np.flatnonzero(last.alike)
        best = min(others, key=lambda n: mean.value if (mean := means[n]) else np.inf)
        cells = self._cells(
            {
                key: np.where(np.isnan(each.answered[at]), np.nan, each.answered[best])
                for key, each in self.numbers.items()
            }
        )
        listed = ", ".join(f"{key} {cell.text}" for key, cell in cells.items())
        return f"{label} {FEWER}; on these {list(self.methods)[best]} has {listed}."

    def _counts(self, where: str) -> list[str]:
        """Sentences on the cases, pairs and clips that the columns are over."""
        over: dict[str, list[str]] = {}
        complete = True
        for column in self.table.columns:
            numbers = self.numbers.get(column.label)
            if numbers is None or not numbers.common.any() or column.chosen_by == "mean":
                continue
            there = [self.infos[int(at)] for at in np.flatnonzero(numbers.common)]
            pairs, clips = (f"{len({getattr(info, of) for info in there})}" for of in ("pair", "clip"))
            if column.pairs:
                complete &= (pairs, clips) == (f"{len(column.pairs)}", f"{self.table.clips}")
                pairs, clips = f"{pairs} of {len(column.pairs)}", f"{clips} of {self.table.clips}"
            cases = f"{count(len(there), 'case')}, pairs {pairs}, clips {clips}"
            over.setdefault(cases, []).append(column.label)
        fewer = f"{where}: not all of the paper's cases; do not compare with the printed numbers."
        return [*counted(where, over), *([] if complete else [fewer])]
