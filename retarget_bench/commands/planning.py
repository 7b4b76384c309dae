"""Plans from the options of a command, and their execution under a progress bar."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from retarget_bench import defaults
from retarget_bench.commands import options
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec

F = TypeVar("F", bound=Callable[..., Any])

OVERWRITE = ("never", "missing", "failed", "always")
_SUITE_NAMES = {"split": "splits", "plugin": "plugins", "metrics": "metric", "overwrite": "redo"}


def _read_suite(ctx: click.Context, param: click.Parameter, path: Path | None) -> None:
    """Use a suite file as the defaults of the other options, so that flags win."""
    del param
    if path is not None:
        from retarget_bench.plugins import suite

        settings = {_SUITE_NAMES.get(name, name): value for name, value in suite.read(path).items()}
        ctx.default_map = {**(ctx.default_map or {}), **settings}


suite_option = click.option(
    "--suite",
    metavar="FILE",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    is_eager=True,
    expose_value=False,
    callback=_read_suite,
    help="A TOML file with the options of this command; options given here win.",
)


metric_option = click.option(
    "-m",
    "--metric",
    multiple=True,
    metavar="NAME",
    shell_complete=options.plugin_names("metrics"),
    help="Metrics to compute; may be repeated. [default: all]",
)


class _WithOldName(click.Option):
    """An option with a former name, the last one, that is still accepted and no longer shown."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        record = super().get_help_record(ctx)
        return record and (record[0].replace(f", {self.opts[-1]}", ""), record[1])


overwrite_option = click.option(
    "--overwrite",
    "--redo",
    "redo",
    cls=_WithOldName,
    type=click.Choice(OVERWRITE),
    default="missing",
    show_default=True,
    help="Results to compute. never: none; missing: missing and outdated ones; failed: these and failed "
    "ones; always: all.",
)


def common_options(command: F) -> F:
    """Add all options of a plan."""
    for option in (
        options.plugin_option,
        options.seeds_option,
        options.seed_option,
        options.jobs_option,
        options.out_option,
        overwrite_option,
        options.split_option,
        options.root_option,
        options.dataset_option,
        suite_option,
    ):
        command = option(command)
    return command


def make_plan(
    methods: Sequence[str],
    *,
    dataset: str,
    root: str | None,
    splits: tuple[str, ...],
    out: Path,
    jobs: int,
    seed: int,
    metric: Sequence[str] = (),
    **others: Any,
) -> Any:
    """A Plan. Without methods or metrics: those that take part in the task by default."""
    from retarget_bench.evaluation import plan

    task = Spec.parse(others.get("task", "retarget")).name
    return plan.Plan(
        methods=tuple(map(Spec.parse, methods)) or _default_methods(task),
        datasets=(options.dataset_spec(dataset, root),),
        splits=splits,
        metrics=tuple(metric) or _default_metrics(task),
        root=out,
        jobs=jobs,
        seed=seed,
        **others,
    )


def _default_methods(task: str = "retarget") -> tuple[Spec, ...]:
    """The methods that take part in a task by default, with the variants that their cards name.

    Derived tasks leave out methods with privileged inputs; where their sources are positions, also methods
    that do not accept positions.
    """
    from retarget_bench.api import TASKS
    from retarget_bench.api.optional import method_card

    kind = "motion" if task in ("retarget", "reconstruct") else "positions"
    specs = []
    for name, each in _working("methods").items():
        card = method_card(each)
        if card.default and task in card.tasks and kind in card.accepts:
            specs += [Spec(name), *(Spec(name, changes) for changes in card.variants)]
    if task != TASKS[0]:
        specs = [spec for spec in specs if not registry.create("methods", spec).card.needs]
    return tuple(specs)


def _default_metrics(task: str = "retarget") -> tuple[str, ...]:
    """All metrics of a task, and for derived tasks ``defaults.TASK_METRICS``. A metric with a value id that
    another one declares is left out; built-in ones come first."""
    from retarget_bench.api import TASKS
    from retarget_bench.api.optional import metric_tasks
    from retarget_bench.errors import BenchError
    from retarget_bench.evaluation.score import declared_values

    kept: dict[str, Any] = {}
    working = {
        name: each
        for name, each in _working("metrics").items()
        if task in metric_tasks(each) or (task != TASKS[0] and name in defaults.TASK_METRICS)
    }
    for name in sorted(
        working, key=lambda name: registry.find("metrics", name).origin != registry.BUILT_IN
    ):
        each = working[name]
        try:
            declared_values([*kept.values(), each])
        except BenchError as problem:
            click.echo(f"bench: left out: {problem}", err=True)
        else:
            kept[name] = each
    return tuple(kept)


def _working(kind: registry.Kind) -> dict[str, Any]:
    """Every plug-in of a kind that can be built; broken ones are reported and left out."""
    found, problems = registry.working(kind)
    for problem in problems:
        click.echo(f"bench: left out: {problem}", err=True)
    return found


def carry_out(plan: Any, what: str) -> list[Any]:
    """Run a plan under a progress bar (shown on a terminal); returns the places of its results."""
    from retarget_bench.evaluation import runner

    with options.progress_bar(what, "case") as progress:
        return runner.run(plan, progress)
