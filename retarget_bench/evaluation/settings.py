"""Settings of a run: how it is carried out."""

from __future__ import annotations

from os import PathLike
from typing import Literal

from retarget_bench import defaults
from retarget_bench.options import Parallel, option

Overwrite = Literal["never", "missing", "failed", "always"]
Stage = Literal["run", "predict", "score"]


class Settings(Parallel):
    """How a run is carried out. Raises BenchError for values that it cannot have."""

    task: str = option(
        "What is asked: retarget, points (the source is known by points on its "
        "surface alone), reconstruct, "
        ""
        "denoise or joint-completion; levels and the number of motions in "
        "brackets: 'denoise[levels=\"0,5\"]'.",
        default="retarget",
    )
    limit: int | None = option(
        "Only N clips of each split, evenly spread.", default=None, at_least=1, metavar="N"
    )
    overwrite: Overwrite = option(
        "Results to compute. never: none; missing: missing and outdated ones; "
        "failed: these and failed ones; "
        "always: all.",
        default="missing",
    )
    out: str | PathLike[str] = option(
        "The folder of results.", default=defaults.OUT, letter="o", metavar="DIR"
    )
    executor: str = option(
        "Where cases are computed: local, ray, slurm or hand, with options in brackets: "
        "'slurm[partition=cpu,cpus=4]'.",
        default="local",
        metavar="NAME",
    )
    seed: int = option(
        "Base seed, from which the seed of every case is derived.", default=0, at_least=0, metavar="N"
    )
    seeds: int = option(
        "Run stochastic methods with this many seeds; tables show the mean and the standard deviation.",
        default=1,
        at_least=1,
        metavar="N",
    )
    timeout: float | None = option(
        "A method that has not answered a case by then has failed on it.",
        default=None,
        shown="a minute, and a second for each frame",
        above=0,
        below=1e9,
        metavar="SECONDS",
    )
    memory: float | None = option(
        "A method that takes more while it answers a case has failed on it.",
        default=None,
        shown="no limit",
        above=0,
        below=1e9,
        metavar="GB",
    )
    isolate: str = option(
        "Start methods under this command: bwrap, so that they can write to no "
        "file of yours and see no other "
        "process, or any other prefix.",
        default="",
        metavar="COMMAND",
    )
