"""``bench plot``: charts of results as files."""

from __future__ import annotations

import click

from retarget_bench.commands import plot_attention, plot_results


@click.group("plot")
def command() -> None:
    """Draw charts of results, as .png, .pdf or .svg."""


for _each in (*plot_results.COMMANDS, plot_attention.attention):
    command.add_command(_each)
