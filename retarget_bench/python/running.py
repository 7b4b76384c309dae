"""``rb.run``: methods on a data set, scored; what is computed stays in a folder of results."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from types import ModuleType

from retarget_bench import defaults
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import clips as of_clips
from retarget_bench.evaluation import plan as plans_
from retarget_bench.evaluation import runner
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.python import plans
from retarget_bench.python.arguments import checked
from retarget_bench.python.plans import Named
from retarget_bench.python.progress import progress_bar
from retarget_bench.python.results import Results


@checked
def run(
    methods: Named | Sequence[Named] = (),
    *,
    dataset: str = defaults.DATASET,
    splits: str | Sequence[str] = (),
    metrics: str | Sequence[str] = (),
    clips: str | Sequence[str] = (),
    limit: int | None = None,
    out: str | PathLike[str] = defaults.OUT,
    root: str | PathLike[str] | None = None,
    plugins: Sequence[str | PathLike[str]] = (),
    overwrite: plans_.Redo = "missing",
    workers: int | None = None,
    executor: str = "local",
    seed: int = 0,
    seeds: int = 1,
    timeout: float | None = None,
    memory: float | None = None,
    isolate: str = "",
    timed: bool = True,
    progress: bool = True,
) -> Results:
    """Run methods on a data set and score them: ``bench run`` from Python.

    Results are kept in the folder ``out``, where the commands find them, too. Only what is missing there,
    or was made by other code, data or parameters, is computed; what an interrupted run finished is kept.

    methods:   specs (``"copy_rotations[root_rule=height]"``), files of methods of your own
               (``"my_method.py"``), or their modules; by default all that are untrained or have weights.
    dataset:   its spec. root: folder of its files, short for ``DATASET[root=DIR]``.
    splits:    of the data set, such as ``cross``; none: all.
    metrics:   by name, or by what they compute (``"MPJPE"``); none: all.
    clips:     only clips of these names (``"walk*"``). A later run without it does the rest.
    limit:     only so many clips of each split, evenly spread.
    plugins:   files of your own metrics, data sets and post-processors, to be named like built-in ones.
    overwrite: what to compute: ``never`` nothing, ``missing``, ``failed`` (also failed cases), ``always``.
    workers:   number of processes; one per core by default, at most eight.
    executor:  where cases are computed: ``"ray"``, ``"slurm[partition=cpu]"`` (docs/clusters.md).
    seeds:     stochastic methods run with so many seeds, from ``seed`` on.
    timeout:   seconds in which a method answers a case; by default a minute, and a second for each frame.
    memory:    gigabytes that a method may take while it answers; by default there is no limit.
    isolate:   a command that methods are started under, such as ``"bwrap"`` (docs/plugins.md).
    timed:     measure the speed of methods, which takes a few seconds.
    progress:  show a progress bar.

    Returns the results of these methods on these splits, and of nothing else in the folder. Raises
    BenchError for whatever is unknown or broken. A method that fails on a case costs that case alone: see
    ``Results.problems``.
    """
    for name, number in (("workers", workers), ("seeds", seeds), ("limit", limit)):
        if number is not None and number < 1:
            raise BenchError(f"{name} is {number}; at least 1 is needed")
    for name, most in (("timeout", timeout), ("memory", memory)):
        if most is not None and not 0 < most < plans_.MOST:
            raise BenchError(f"{name} is {most:g}; it must be above 0 and below {plans_.MOST:g}")
    if not isinstance(methods, tuple) and not len(list(_several(methods))):
        raise BenchError(
            "methods is empty, so that nothing is to be run; name some, or leave it out for all that are "
            "untrained or come with weights"
        )
    plans_.forget()
    registry.refresh_files()
    for file in plugins:
        registry.add_file(Path(file))
    data = Spec.parse(dataset)
    plan = plans.make_plan(
        [plans.method_spec(each) for each in _several(methods)],
        [data if root is None else data.with_parameters(root=str(root))],
        (metrics,) if isinstance(metrics, str) else metrics,
        plans.warn,
        splits=(splits,) if isinstance(splits, str) else tuple(splits),
        root=Path(out),
        redo=overwrite,
        jobs=workers or defaults.jobs(),
        executor=executor,
        seed=seed,
        seeds=seeds,
        timeout=timeout or 0.0,
        memory=memory or 0.0,
        isolate=isolate,
        clips=of_clips.patterns((clips,) if isinstance(clips, str) else clips),
        limit=limit or 0,
    )
    with progress_bar("run", "answers", progress) as told:
        places = runner.run(plan, told, timed=timed)
    return Results(plans.existing(places, plan.root), variants=bool(methods))


def _several(methods: Named | Sequence[Named]) -> Sequence[Named]:
    if isinstance(methods, str | PathLike | ModuleType) or callable(methods):
        return [methods]
    return methods
