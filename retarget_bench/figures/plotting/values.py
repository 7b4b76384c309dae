"""Which value a picture shows, and panels that have nothing else."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass

from retarget_bench.analysis.summary import Mean, SplitSummary
from retarget_bench.errors import BenchError
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.results.result_matrix import ResultMatrix
from retarget_bench.results.store import ARRAY_INDICES

ARROWS = {"lower": " ↓", "higher": " ↑", "none": ""}


@dataclass(frozen=True)
class Shown:
    """A value as its results declare it."""

    id: str
    declared: DeclaredValue

    @property
    def axis(self) -> str:
        """``error, world, % of height ↓``."""
        unit = "" if self.declared.unit == "1" else f", {self.declared.unit}"
        better = self.declared.better
        return f"{self.declared.label}{unit}{ARROWS.get(better) or self._goal}"

    @property
    def _goal(self) -> str:
        return f" →{self.declared.goal:g}" if self.declared.better == "target" else ""


def shown(panels: Sequence[ResultMatrix], value: str, index: str = "") -> Shown:
    """The value that is asked for, which has to be one number per case, or a curve over ``index``.

    Raises BenchError where no result has it (the sentence names those that there are), or none on any case.
    """
    there = {key: each for panel in panels for key, each in panel.values.items() if each.index == index}
    if value in there:
        in_rows = index not in ARRAY_INDICES
        if in_rows and not any(key[0] == value for panel in panels for key in panel.keys):
            raise BenchError(f"no method of these results has {value} on any case; bench table says why")
        return Shown(value, there[value])
    kind = f"per {index}" if index else "as one number per case"
    if not there:
        raise BenchError(f"these results know nothing {kind}; bench score computes what metrics give")
    near = difflib.get_close_matches(value, there, 3, 0.5) or list(there)[:6]
    raise BenchError(f"no result has {value} {kind}; choose by --value, for instance {', '.join(near)}")


def mean_of(section: SplitSummary, label: str, value: str) -> Mean | None:
    """The number of a method, or None where it has none."""
    return next((score.means.get(value) for score in section.scores if score.label == label), None)


def headers(panels: Sequence[ResultMatrix]) -> dict[str, ResultHeader]:
    """Label -> a header of its results, for ``canvas.looks``."""
    return {row.label: row.header for panel in panels for row in panel.rows}
