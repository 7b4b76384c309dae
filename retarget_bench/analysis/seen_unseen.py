"""What a learned method does on structures that its training had, and on those that it had not."""

from __future__ import annotations

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
    """One method alone, on the cases whose targets are of structures that its weights know, or not.

    seen:       whether its training manifest has the structures.
    structures: which these are, in alphabetical order; those of which it answered no case are left out.
    sections:   one per group of the breakdown, each of this method alone.
    """

    label: str
    seen: bool
    structures: tuple[str, ...]
    sections: tuple[SplitSummary, ...]


def seen_and_unseen(places: Iterable[ResultPaths], by: By) -> list[SeenPart]:
    """Two halves of every method that was trained on some of the structures that it answered for and not on
    others, the seen one first; nothing of all other methods.

    by: what every half is broken down by. Raises BenchError where the results of a trained method do not
    say of what structure bodies are, or do not know what they are to be broken down by.
    """
    return [half for panel in result_matrices(places) for half in _of_panel(panel, by)]


def _of_panel(panel: ResultMatrix, by: By) -> list[SeenPart]:
    known = {row.label: _known(row.header) for row in panel.rows}
    if not any(known.values()):
        return []
    structure_of = structures_of(panel)
    structures = np.array([structure_of[info.id] for info in panel.cases])
    found = []
    for row in panel.rows:
        had = np.isin(structures, sorted(known[row.label]))
        alone = replace(panel, rows=(row,))
        answered = _answered(alone)
        if not known[row.label] or not (had & answered).any() or not (~had & answered).any():
            continue
        for seen, mine in ((True, had), (False, ~had)):
            parts = breakdown(alone.restricted(mine, ""), by)
            names = tuple(sorted(set(structures[mine & answered].tolist())))
            found.append(SeenPart(row.label, seen, names, tuple(split_summary(part) for part in parts)))
    return found


def _answered(alone: ResultMatrix) -> np.ndarray:
    """``(cases,)`` bool: where a panel's only method has any number."""
    found = np.zeros(len(alone.cases), dtype=bool)
    for key in alone.keys:
        found |= ~np.isnan(alone.numbers(key)[0])
    return found


def _known(header: ResultHeader) -> frozenset[str]:
    """The structures that the weights behind a result were trained on; none where there are no weights."""
    trained = header.method.trained_on or {}
    return frozenset(trained.get("structures", ()))
