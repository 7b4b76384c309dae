"""``bench predict``: the first stage alone."""

import json
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
        folder = place.folder / place.method
        click.echo(f"{sum(1 for _ in folder.glob('*.npz'))} predictions in {folder}")
        notes = sorted(folder.glob("*.json"))
        if notes:
            first = json.loads(notes[0].read_text(encoding="utf-8"))
            click.echo(
                f"  {len(notes)} cases without one; the first: {first['status']}, {first['message']}"
            )
