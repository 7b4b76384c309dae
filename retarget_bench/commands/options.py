"""Options that several commands share, and the help that the shell gives while one types."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click
from click.shell_completion import CompletionItem

from retarget_bench import defaults
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec

F = TypeVar("F", bound=Callable[..., Any])

SPLITS = ("self", "intra", "cross")
MOST_JOBS = 8
"""Processes that are started unasked; more must be asked for, since each one takes memory."""


def plugin_names(
    *kinds: registry.Kind,
) -> Callable[[click.Context, click.Parameter, str], list[CompletionItem]]:
    """Shell completion by the names of plug-ins, none imported; post-processes behind a ``+``."""

    def complete(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        del ctx, param
        before, plus, begun = incomplete.rpartition("+")
        found: tuple[registry.Kind, ...] = ("posts",) if plus else kinds
        entries = [entry for kind in found for entry in registry.names(kind)]
        fitting = [entry for entry in entries if entry.name.startswith(begun)]
        return [CompletionItem(before + plus + e.name, help=e.summary) for e in fitting]

    return complete


SEED = click.IntRange(0, 2**63 - 1)
"""What torch takes as a seed."""


TASKS = {
    "retarget": "retarget",
    "reconstruct": "reconstruct",
    "denoise": "denoise",
    "joint-completion": "upsample",
}
"""Name of a task on the command line -> its id, which results are stored under."""


class TaskChoice(click.Choice[str]):
    """A task by its name; its id, and ``_`` in place of ``-``, are accepted too. Gives the id."""

    def __init__(self) -> None:
        super().__init__(list(TASKS))

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        if value in TASKS.values():
            return str(value)
        return TASKS[super().convert(value.replace("_", "-"), param, ctx)]


def task_name(task: str) -> str:
    """The name of a task on the command line."""
    return next(name for name, id_ in TASKS.items() if id_ == task)


def dataset_spec(dataset: str, root: str | Path | None = None) -> Spec:
    """The data set that ``-d`` and ``--root`` name together; ``--root`` wins."""
    spec = Spec.parse(dataset)
    return spec if root is None else spec.with_parameters(root=str(root))


def _add_plugins(ctx: click.Context, param: click.Parameter, paths: tuple[str, ...]) -> tuple[str, ...]:
    del ctx, param
    for path in paths:
        registry.add_file(path)
    return paths


def _split_names(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> tuple[str, ...]:
    """``-s self -s cross`` and ``-s self,cross`` are the same; none means every split."""
    asked = [name.strip() for each in given for name in each.split(",")]
    if unknown := [name for name in asked if name not in SPLITS]:
        raise click.BadParameter(
            f"no split is called {unknown[0]!r}; there are {', '.join(SPLITS)}", ctx, param
        )
    return tuple(name for name in SPLITS if name in asked or not asked)


def _job_count(ctx: click.Context, param: click.Parameter, given: int | None) -> int:
    del ctx, param
    return given or min(usable_cores(), MOST_JOBS)


def usable_cores() -> int:
    """How many cores this process may use, which in a container is often fewer than there are."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def plugin_option(command: F) -> F:
    """``--plugin FILE``: known from here on through ``registry``."""
    return click.option(
        "--plugin",
        "plugins",
        multiple=True,
        metavar="FILE",
        is_eager=True,
        callback=_add_plugins,
        type=click.Path(),
        help="Also know the method, metric, data set or post-process in this Python file.",
    )(command)


def dataset_option(command: F) -> F:
    """``-d/--dataset SPEC`` as the text ``dataset``."""
    return click.option(
        "-d",
        "--dataset",
        metavar="DATASET",
        default=defaults.DATASET,
        show_default=True,
        shell_complete=plugin_names("datasets"),
        help="The data set, with its options in brackets.",
    )(command)


def root_option(command: F) -> F:
    """``--root DIR`` as the text ``root`` or None."""
    return click.option(
        "--root", metavar="DIR", type=click.Path(), help="Where the data lie: short for DATASET[root=DIR]."
    )(command)


def split_option(command: F) -> F:
    """``-s/--split`` as the tuple ``splits``: the ones asked for, or all."""
    return click.option(
        "-s",
        "--split",
        "splits",
        multiple=True,
        metavar="SPLIT",
        callback=_split_names,
        help="self, intra (same structure) or cross (another structure); may be repeated. [default: all]",
    )(command)


def out_option(command: F) -> F:
    """``--out DIR`` as the path ``out``: where results are kept."""
    return click.option(
        "--out",
        metavar="DIR",
        default="runs",
        show_default=True,
        type=click.Path(file_okay=False, path_type=Path),
        help="The folder of results.",
    )(command)


def jobs_option(command: F) -> F:
    """``-j/--jobs N`` as the integer ``jobs``: the number of processes."""
    return click.option(
        "-j",
        "--jobs",
        type=click.IntRange(min=1),
        callback=_job_count,
        metavar="N",
        help=f"Processes to use. [default: one per core, at most {MOST_JOBS}]",
    )(command)


def seed_option(command: F) -> F:
    """``--seed N`` as the integer ``seed``."""
    return click.option(
        "--seed",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        metavar="N",
        help="Base of every case's seed.",
    )(command)


def seeds_option(command: F) -> F:
    """``--seeds N`` as the integer ``seeds``."""
    return click.option(
        "--seeds",
        type=click.IntRange(min=1),
        default=1,
        show_default=True,
        metavar="N",
        help="Run stochastic methods with this many seeds; tables show their mean and its spread.",
    )(command)
