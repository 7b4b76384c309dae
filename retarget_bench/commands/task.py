"""``bench task``: reconstruction, denoising and joint completion on any data set."""

from collections.abc import Callable
from copy import copy
from typing import Any, TypeVar

import click

from retarget_bench.commands import options, planning

F = TypeVar("F", bound=Callable[..., Any])


@click.group("task")
def command() -> None:
    """Run reconstruction, denoising or joint completion on the motions of a data set.

    The clean motions of any data set are the references. `bench table --task TASK` and `bench plot TASK`
    show the results, which are stored beside those of `bench run`.
    """


def _common(function: F) -> F:
    """The options that all tasks share."""
    for option in (
        options.plugin_option,
        options.seeds_option,
        options.seed_option,
        options.jobs_option,
        options.out_option,
        planning.overwrite_option,
        planning.metric_option,
        options.root_option,
        options.dataset_option,
        click.option(
            "--motions",
            type=click.IntRange(1),
            metavar="N",
            help="At most so many motions, evenly over structures and clips. [default: all]",
        ),
        click.argument(
            "methods", nargs=-1, metavar="[METHOD]...", shell_complete=options.plugin_names("methods")
        ),
    ):
        function = option(function)
    return function


@command.command("reconstruct")
@_common
def reconstruct(**given: Any) -> None:
    """Reconstruct motions through a method, and measure its loss in centimetres (HuMoT, Table 2).

    With no METHOD: all that take part in a plain run.
    """
    _carry_out("reconstruct", None, **given)


@command.command("denoise")
@click.option(
    "--levels", metavar="CM,CM", help="Standard deviations of the noise. [default: 0 to 10, nine levels]"
)
@_common
def denoise(levels: str | None, **given: Any) -> None:
    """Denoise positions with Gaussian noise (HuMoT, Figure 8).

    With no METHOD: all that take part in a plain run and can read positions.
    """
    _carry_out("denoise", levels, **given)


@command.command("joint-completion")
@click.option(
    "--levels",
    metavar="P,P",
    help="Proportions of joints given, drawn at random, or major: ankles, knees, hips, shoulders, elbows "
    "and wrists. [default: 0.1 to 1 in tenths, and major]",
)
@_common
def joint_completion(levels: str | None, **given: Any) -> None:
    """Complete motions of which some joints' positions are given (HuMoT, Figures 9 and 12).

    With no METHOD: all that take part in a plain run and can read positions.
    """
    _carry_out("upsample", levels, **given)


_alias = copy(joint_completion)
_alias.hidden = True
for _name in ("joint_completion", "upsample"):
    command.add_command(_alias, _name)


def _carry_out(
    name: str, levels: str | None, methods: tuple[str, ...], motions: int | None, **given: Any
) -> None:
    from retarget_bench.errors import BenchError
    from retarget_bench.evaluation import tasks
    from retarget_bench.tables.rendering import text
    from retarget_bench.tables.task_tables import task_tables

    task = str(tasks.canonical(name, levels, motions or 0))
    plan = planning.make_plan(methods, splits=("self",), task=task, **given)
    shown = options.task_name(name)
    places = planning.carry_out(plan, f"bench task {shown}")
    there = [place for place in places if place.header.exists()]
    if not there:
        raise BenchError(f"no results in {plan.root}, and --overwrite never makes none")
    click.echo(text(task_tables(there, name)))
    click.echo(f"All values: bench table {plan.root} --task {shown} --all. Rows lie in {plan.root}/.")
