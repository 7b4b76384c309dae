"""Results in metres: numbers in per cent of the target's height, times the height of each case's target."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.results import case_metadata
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.result_matrix import ResultMatrix
from retarget_bench.results.rows import Key, Numbers, derived
from retarget_bench.results.store import ResultPaths

UNITS = {"% of height": "m", "% of height/s": "m/s"}
"""Units of values that can be shown in metres -> what they become."""


def in_metres(matrix: ResultMatrix) -> ResultMatrix:
    """A matrix in which every value of ``UNITS`` is in metres; the others are as they are.

    Means, intervals and ties are then those of metres: a mean of metres is not the mean in per cent times
    a mean height. Raises BenchError where results do not say how tall their targets are.
    """
    relative = {key for key, value in matrix.values.items() if value.unit in UNITS}
    metres = per_cent((row.paths for row in matrix.rows), matrix.cases)

    def converted(run: Numbers, key: Key) -> np.ndarray:
        return run[key] * metres if key[0] in relative else run[key]

    rows = (
        replace(row, runs=tuple(derived(run, partial(converted, run)) for run in row.runs))
        for row in matrix.rows
    )
    values = {key: _declared(value) if key in relative else value for key, value in matrix.values.items()}
    return replace(matrix, rows=tuple(rows), values=values)


def per_cent(places: Iterable[ResultPaths], cases: Sequence[CaseInfo]) -> np.ndarray:
    """``(cases,)`` metres: a hundredth of the height of every case's target, nan where it is not known.

    places: the results of these cases. Raises BenchError where they do not say.
    """
    heights: dict[str, float] = {}
    for place in places:
        of_split = case_metadata.read(place).heights
        if not of_split:
            raise BenchError(
                f"the results in {place.folder} do not say how tall their targets are, and so cannot be "
                "shown in metres; bench run adds it"
            )
        heights |= of_split
    return np.array([heights.get(info.target, np.nan) for info in cases]) / 100.0


def _declared(value: DeclaredValue) -> DeclaredValue:
    """The declaration of a value in metres. Its tolerance is that of a body one metre tall."""
    protocol: Mapping[str, str] = value.protocol
    if protocol.get("divided by") == "h":
        protocol = {**protocol, "divided by": "1"}
    return replace(
        value,
        unit=UNITS[value.unit],
        tolerance=value.tolerance / 100.0,
        formula=f"h / 100 times what follows, h of each case's target: {value.formula}",
        protocol=protocol,
    )
