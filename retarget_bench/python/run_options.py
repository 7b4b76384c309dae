"""Options of a run: of ``bench run``, ``rb.run`` and suite files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from types import ModuleType
from typing import Any

from retarget_bench import defaults
from retarget_bench.evaluation.settings import Settings
from retarget_bench.options import Names, OfSplits, option

MethodLike = str | PathLike[str] | ModuleType | Callable[..., Any]
"""A method by its spec (``"ik"``), by the file of its plug-in, or by that file's module or ``plugin``."""


class RunOptions(OfSplits, Settings):
    """Methods, data and metrics of a run, by name."""

    methods: MethodLike | Sequence[MethodLike] = option(
        "The methods; none: all that are untrained or come with weights.", default=(), kw_only=False
    )
    dataset: str = option(
        "The data set, with its parameters in brackets.",
        default=defaults.DATASET,
        letter="d",
        metavar="DATASET",
        names=("datasets",),
    )
    root: str | PathLike[str] | None = option(
        "Folder of the data: short for DATASET[root=DIR].", default=None, metavar="DIR"
    )
    metrics: Names = option(
        "Metrics to compute, by name or by a value of theirs (MPJPE), or `default`: those of a plain run.",
        default=(),
        shown="default",
        metavar="METRIC",
        names=("metrics",),
    )
    clips: Names = option(
        "Only clips of these names ('walk*,jump*'). A later run without it does the rest.",
        default=(),
        metavar="PATTERN",
    )
    timed: bool = option(
        "Measure the speed of methods, which takes a few seconds.", default=True, python=True
    )
    progress: bool = option("Show a progress bar.", default=True, python=True)
