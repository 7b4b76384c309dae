"""Results of learned methods on structures seen and unseen in training."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from retarget_bench.analysis.breakdown import By, breakdown, structures_of
from retarget_bench.analysis.summary import SplitSummary, split_summary
from retarget_bench.results.header import ResultHeader
from retarget_bench.results.result_matrix import ResultMatrix, result_matrices
from retarget_bench.results.store import ResultPaths


@dataclass(frozen=True)
class SeenPart:
    """One method on the cases whose target structures were seen in its training, or on the other ones.

    seen:       whether its training data have the structures.
    structures: which these are, in alphabetical order; those of which it answered no case are left out.
    sections:   one per group of the breakdown, each of this method alone.
    """

    label: str
    seen: bool
    structures: tuple[str, ...]
    sections: tuple[SplitSummary, ...]


def seen_and_unseen(places: Iterable[ResultPaths], by: By) -> list[SeenPart]:
    """The seen and the unseen part of every method that has answers on both, the seen one first.

    by: the breakdown of every part. Raises BenchError where the results lack the structures of bodies, or
    the metadata that the breakdown needs.
    """
    return [part for matrix in result_matrices(places) for part in _of_matrix(matrix, by)]


def _of_matrix(matrix: ResultMatrix, by: By) -> list[SeenPart]:
    known = {row.label: _known(row.header) for row in matrix.rows}
    if not any(known.values()):
        return []
    structure_of = structures_of(matrix)
    structures = np.array([structure_of[info.id] for info in matrix.cases])
    found = []
    for row in matrix.rows:
        had = np.isin(structures, sorted(known[row.label]))
        alone = replace(matrix, rows=(row,))
        answered = _answered(alone)
        if not known[row.label] or not (had & answered).any() or not (~had & answered).any():
            continue
        for seen, mine in ((True, had), (False, ~had)):
            parts = breakdown(alone.restricted(mine, ""), by)
            names = tuple(sorted(set(structures[mine & answered].tolist())))
            found.append(SeenPart(row.label, seen, names, tuple(split_summary(part) for part in parts)))
    return found


def _answered(alone: ResultMatrix) -> np.ndarray:
    """``(cases,)`` bool: where a matrix's only method has any number."""
    found = np.zeros(len(alone.cases), dtype=bool)
    for key in alone.keys:
        found |= ~np.isnan(alone.numbers(key)[0])
    return found


def _known(header: ResultHeader) -> frozenset[str]:
    """The structures in the training data of a result's weights; empty for untrained methods."""
    trained = header.method.trained_on or {}
    return frozenset(trained.get("structures", ()))
