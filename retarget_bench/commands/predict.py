"""``bench predict``: the first stage alone."""

from __future__ import annotations

from typing import Any

import click

from retarget_bench.commands import options, planning


@click.command("predict")
@click.argument(
    "methods", nargs=-1, required=True, metavar="METHOD...", shell_complete=options.plugin_names("methods")
)
@planning.common_options
def command(methods: tuple[str, ...], **given: Any) -> None:
    """Write the predictions of methods on a data set; `bench score` scores them later."""
    plan = planning.make_plan(methods, stage="predict", **given)
    places = planning.carry_out(plan, "bench predict")
    for place in places:
        count = sum(1 for _ in (place.folder / place.method).glob("*.npz"))
        click.echo(f"{count} predictions in {place.folder / place.method}")
