"""Plans from the names of methods and metrics, and the defaults where none are named."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import fields
from os import PathLike
from pathlib import Path
from types import ModuleType
from typing import Any

from retarget_bench import defaults
from retarget_bench.api import PAIRED, TASKS
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import clips, tasks
from retarget_bench.evaluation.plan import Plan
from retarget_bench.evaluation.settings import Settings
from retarget_bench.options import listed
from retarget_bench.plugins import named, registry
from retarget_bench.plugins.assets import asset_hashes
from retarget_bench.plugins.bound import declared_values
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.run_options import MethodLike as MethodLike
from retarget_bench.python.run_options import RunOptions
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import names

Tell = Callable[[str], None]
BY_DEFAULT = "default"
"""Stands for all metrics that take part in a task by default."""


def plan_of(options: RunOptions, tell: Tell, **others: Any) -> Plan:
    """The plan of what is asked for. Without methods or metrics: those that take part in the task by
    default. The metric ``default`` stands for all of these, beside which others may be named.

    tell: is given a sentence for every broken plug-in that is left out. others: fields of the plan.
    Raises BenchError for files that are no plug-ins, and for a list without methods.
    """
    task = tasks.canonical(Spec.parse(options.task))
    methods = several(options.methods)
    settings = {each.name: getattr(options, each.name) for each in fields(Settings)}
    if not methods and options.methods != ():
        raise BenchError(
            "methods is empty, so that nothing is to be run; name some, or leave it out for all that are "
            "untrained or come with weights"
        )
    return Plan(
        methods=tuple(map(method_spec, methods)) or default_methods(task.name, tell),
        datasets=(named.dataset(options.dataset, options.root),),
        splits=listed(options.splits),
        metrics=_metrics(listed(options.metrics), task.name, tell),
        clips=clips.check([options.clips] if isinstance(options.clips, str) else options.clips),
        **settings | {"task": str(task), "out": Path(options.out)} | others,
    )


def several(methods: MethodLike | Sequence[MethodLike]) -> Sequence[MethodLike]:
    """One method, or some, as a list."""
    if isinstance(methods, str | PathLike | ModuleType) or callable(methods):
        return [methods]
    return methods


def _metrics(requested: Sequence[str], task: str, tell: Tell) -> tuple[str, ...]:
    others = metric_names([named.with_names(each) for each in requested if each != BY_DEFAULT])
    usual = default_metrics(task, tell) if BY_DEFAULT in requested or not requested else ()
    return tuple(dict.fromkeys([*usual, *others]))


def default_methods(task: str, tell: Tell) -> tuple[Spec, ...]:
    """The methods that take part in a task by default, with the variants that their cards name.

    Tasks whose sources are positions or points leave out methods that do not accept them, and derived tasks
    of one body methods with privileged inputs.
    """
    kind = {"denoise": "positions", "joint-completion": "positions", "points": "points"}.get(task, "motion")
    specs = []
    for name, each in _working("methods", tell).items():
        card = each.card
        if card.default and task in card.tasks and kind in card.accepts:
            try:
                asset_hashes(each)
            except BenchError as problem:
                tell(str(problem))
                continue
            specs += [Spec(name), *(Spec(name, changes) for changes in card.variants)]
    if task not in PAIRED:
        specs = [spec for spec in specs if not registry.create("methods", spec).card.needs]
    return tuple(specs)


def default_metrics(task: str, tell: Tell) -> tuple[str, ...]:
    """All metrics of a task, for those of one body also ``defaults.TASK_METRICS``. A metric with a value id
    that another one declares is left out; built-in ones come first."""
    chosen: dict[str, Any] = {}
    working = _working("metrics", tell)
    for name in sorted(
        working, key=lambda each: registry.find("metrics", each).origin != registry.BUILT_IN
    ):
        each = working[name]
        tasks = each.card.tasks
        takes_part = TASKS[0] in tasks or task in tasks if task in PAIRED else task in tasks
        if not takes_part and (task in PAIRED or name not in defaults.TASK_METRICS):
            continue
        try:
            declared_values([*chosen.values(), each])
        except BenchError as problem:
            tell(str(problem))
        else:
            chosen[name] = each
    return tuple(chosen)


def metric_names(requested: Sequence[str]) -> tuple[str, ...]:
    """The metrics of these names: their own, or labels, ids and families of their values (``MPJPE``).

    What is neither is given back: the registry answers it.
    """
    if not requested:
        return ()
    values_by_id, plug_ins = names.installed(), {entry.name for entry in registry.names("metrics")}
    metrics: dict[str, None] = {}
    for each in requested:
        plug_in = registry.spelled(each, ("metrics",))
        own = plug_in.partition("[")[0] in plug_ins
        values = [] if own else names.candidates(each, values_by_id)
        metrics |= dict.fromkeys([values_by_id[key].metric for key in values] or [plug_in])
    return tuple(metrics)


def _working(kind: registry.Kind, tell: Tell) -> dict[str, Any]:
    """Every plug-in of a kind that can be built; ``tell`` gets a sentence for each broken one."""
    plugins, problems = registry.working(kind)
    for problem in problems:
        tell(problem)
    return plugins


def existing(places: Sequence[ResultPaths], root: Path) -> list[ResultPaths]:
    """The places that have results. Raises BenchError where none has."""
    if there := [place for place in places if place.any_header.exists()]:
        return there
    raise BenchError(f"no results in {root}, and overwrite never makes none")


def warn(problem: str) -> None:
    """Warn of a plug-in that is left out."""
    warnings.warn(f"left out: {problem}", stacklevel=2)


def method_spec(method: MethodLike) -> Spec:
    """The spec of a method, whose file is added to the registry where it is given by one.

    Raises BenchError for what worker processes cannot find by a name or a file.
    """
    if isinstance(method, str):
        return named.parse(method)
    # what is no path is imported already
    entry = named.add_file(method) if isinstance(method, PathLike) else registry.add_file(_file_of(method))
    if entry.kind != "methods":
        raise BenchError(f"{entry.origin} is a {registry.SINGULAR[entry.kind]}, and a method is asked for")
    return Spec(entry.name)


def _file_of(method: object) -> Path:
    """The file of a plug-in's module, or of the class or function that is the ``plugin`` of its module."""
    module = (
        method if isinstance(method, ModuleType) else sys.modules.get(getattr(method, "__module__", ""))
    )
    file = getattr(module, "__file__", None)
    is_plugin = method is module or getattr(module, "plugin", None) is method
    if not file or not is_plugin or module is sys.modules["__main__"]:
        name = getattr(method, "__name__", type(method).__name__)
        raise BenchError(
            f"{name} cannot be run: worker processes find a method by its name or file. Write it to a file "
            f"that ends with the line plugin = {name}, and give the path of that file"
        )
    return Path(file)
