"""``bench run``: predict and score what is missing, then the table."""

from typing import Any

import click

from retarget_bench.commands import options, planning


@click.command("run")
@click.argument("methods", nargs=-1, metavar="[METHOD]...", shell_complete=options.plugin_names("methods"))
@planning.common_options
@planning.metric_option
def command(methods: tuple[str, ...], **given: Any) -> None:
    """Run methods on a data set, score them, and print the table.

    With no METHOD: all that are untrained or come with weights. Results are kept; a second run computes
    only what is missing, and an interrupted one goes on where it stopped.
    """
    from retarget_bench.analysis import summary
    from retarget_bench.errors import BenchError
    from retarget_bench.evaluation import timing
    from retarget_bench.tables import builder
    from retarget_bench.tables.rendering import text

    plan = planning.make_plan(methods, **given)
    places = planning.carry_out(plan, "bench run")
    if plan.redo != "never":
        timing.measure(plan)
    there = [place for place in places if place.header.exists()]
    if not there:
        raise BenchError(f"no results in {plan.root}, and --overwrite never makes none")
    click.echo(text(builder.tables(summary.split_summaries(there))))
    click.echo(f"All values: bench table {plan.root} --all. Rows lie in {plan.root}/.")
