"""``bench doctor``: how motion files are read."""

import click

from retarget_bench.commands.options import reading_options
from retarget_bench.errors import BenchError


@click.command("doctor")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path())
@reading_options()
def command(files: tuple[str, ...], unit: str, up: str, root_place: str, roles: str | None) -> int:
    """Say what was found in motion files, and what to override where that is wrong.

    Joints and their roles, unit, up axis, rest pose, frame rate and floor: what every other command goes
    by. The options tell it better, and are the same in bench retarget.
    """
    from retarget_bench.motion.importer import load

    unreadable = 0
    for number, file in enumerate(files):
        try:
            text = load(file, unit=unit, up=up, root=root_place, roles=roles).findings.text()
        except BenchError as error:
            click.echo(f"bench: {error}", err=True)
            unreadable += 1
        else:
            click.echo(("\n" if number else "") + text)
    return 2 if unreadable else 0
