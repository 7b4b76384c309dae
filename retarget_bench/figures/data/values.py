"""The value of a chart, its methods in order, and its means and worst cases as in tables."""

import difflib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from retarget_bench.analysis import ranking, statistics, summary
from retarget_bench.analysis.summary import Mean
from retarget_bench.figures.data.model import Cases, NothingToDraw
from retarget_bench.figures.palette import MethodStyle
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.paths import ARRAY_INDICES
from retarget_bench.results.result_matrix import ResultMatrix
from retarget_bench.tables.builder import DEFAULT_COLUMNS

ARROWS = {"lower": " ↓", "higher": " ↑", "none": ""}
WORST = 6
"""Cases that are kept behind a mark that has no group of its own."""


@dataclass(frozen=True)
class Value:
    """A value as its results declare it."""

    id: str
    declared: DeclaredValue

    @property
    def axis(self) -> str:
        """``error, world, % of height ↓``."""
        better = self.declared.better
        goal = f" →{self.declared.goal:g}" if better == "target" else ""
        return f"{self.declared.label}{self.unit and ', ' + self.unit}{ARROWS.get(better) or goal}"

    @property
    def unit(self) -> str:
        return "" if self.declared.unit == "1" else self.declared.unit

    def losses(self, numbers: np.ndarray) -> np.ndarray:
        """Losses of the same shape: less is better."""
        return statistics.losses(numbers, self.declared.better, self.declared.goal)


def value_of(matrices: Sequence[ResultMatrix], value: str, index: str = "") -> Value:
    """The value that is asked for, which has to be one number per case, or a curve over ``index``.

    Raises NothingToDraw where no result has it (the sentence names those that there are), or none on any
    case.
    """
    there = {key: each for one in matrices for key, each in one.values.items() if each.index == index}
    if value in there:
        in_rows = index not in ARRAY_INDICES
        if in_rows and not any(key[0] == value for one in matrices for key in one.keys):
            raise NothingToDraw(f"no method of these results has {value} on any case; bench table says why")
        return Value(value, there[value])
    kind = f"per {index}" if index else "as one number per case"
    if not there:
        raise NothingToDraw(f"these results know nothing {kind}; bench run computes what metrics give")
    usual = [key for key in DEFAULT_COLUMNS if key in there]
    near = difflib.get_close_matches(value, there, 3, 0.5) or [*usual, *there][:3]
    raise NothingToDraw(f"no result has {value} {kind}; choose by --columns, such as {', '.join(near)}")


Styles = Mapping[str, MethodStyle]
"""Label -> the style of a method, in the order of the tables."""


def in_order(matrices: Sequence[ResultMatrix], styles: Styles) -> list[ResultMatrix]:
    """Matrices with their methods in this order; others follow as they are."""
    places = {label: place for place, label in enumerate(styles)}
    return [
        replace(each, rows=tuple(sorted(each.rows, key=lambda row: places.get(row.label, len(places)))))
        for each in matrices
    ]


def shown(labels: Iterable[str], styles: Styles) -> list[str]:
    """The methods that charts show without being asked: all but controls and variants, where there are
    others."""
    labels = list(dict.fromkeys(labels))
    loud = [label for label in labels if not (label in styles and styles[label].quiet)]
    return loud or labels


def unranked(matrix: ResultMatrix, value: str = "") -> dict[str, str]:
    """Label -> why a method is not ranked, by a value or at all; "" of those that are."""
    few = summary.common_numbers(matrix, value)[3] if value else {}
    reasons = ((row, few.get(place, "")) for place, row in enumerate(matrix.rows))
    return {row.label: ranking.unranked(row.header) or why for row, why in reasons}


def means(matrix: ResultMatrix, value: str) -> dict[str, Mean]:
    """Label -> the mean over clips of means over cases, as in tables, of methods that have one; not of
    those that lack so many of the cases that theirs would be over others."""
    numbers, _, _, few = summary.common_numbers(matrix, value)
    means_of = zip(matrix.rows, summary.means_over_clips(numbers, matrix.clips), strict=True)
    return {row.label: m for k, (row, m) in enumerate(means_of) if m is not None and k not in few}


def worst(
    matrix: ResultMatrix,
    value: str,
    numbers: np.ndarray,
    what: str,
    most: int = WORST,
) -> Cases:
    """The worst of ``(cases,)`` numbers of a value (as it is declared), each with its number."""
    loss = Value(value, matrix.values[value]).losses(numbers)
    order = np.argsort(-loss, kind="stable")[: int((~np.isnan(loss)).sum())][:most]
    worst_cases = tuple((int(case), float(numbers[case])) for case in order)
    return Cases(matrix.split, value, worst=worst_cases, what=what)


def numbers_at(matrix: ResultMatrix, value: str) -> Callable[[str, str], np.ndarray]:
    """A function from a label and a point of a curve ("" for a plain value) to ``(cases,)`` numbers."""
    rows = {row.label: number for number, row in enumerate(matrix.rows)}
    cached: dict[str, np.ndarray] = {}

    def at(label: str, index: str = "") -> np.ndarray:
        if index not in cached:
            cached[index] = matrix.numbers((value, index))
        column: np.ndarray = cached[index][rows[label]]
        return column

    return at
