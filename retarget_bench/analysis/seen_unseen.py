"""Results of learned methods on structures seen and unseen in training."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from retarget_bench.analysis.breakdown import By, breakdown, structures_of
from retarget_bench.analysis.summary import SplitSummary, split_summary
from retarget_bench.results.result_matrix import result_matrices
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
    halves = []
    for matrix in result_matrices(places):
        manifests = [row.header.method.trained_on or {} for row in matrix.rows]
        trained = [list(manifest.get("structures", ())) for manifest in manifests]
        if not any(trained):
            continue
        structure_of = structures_of(matrix)
        structures = np.array([structure_of[info.id] for info in matrix.cases])
        for row, known in zip(matrix.rows, trained, strict=True):
            had = np.isin(structures, known)
            alone = replace(matrix, rows=(row,))
            answered = np.zeros(len(matrix.cases), dtype=bool)
            for key in alone.keys:
                answered |= ~np.isnan(alone.numbers(key)[0])
            if not (had & answered).any() or not (~had & answered).any():
                continue
            for seen, cases in ((True, had), (False, ~had)):
                parts = tuple(split_summary(part) for part in breakdown(alone.restricted(cases, ""), by))
                names = tuple(sorted(set(structures[cases & answered].tolist())))
                halves.append(SeenPart(row.label, seen, names, parts))
    return halves
