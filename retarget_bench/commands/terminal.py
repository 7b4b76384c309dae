"""What commands print: whatever text files and plug-ins bring, nothing in it steers the terminal."""

import click

from retarget_bench.errors import visible


def echo(text: str = "", *, err: bool = False, nl: bool = True) -> None:
    """Print a text, which may have several lines. err: to the error output; nl: end the line."""
    click.echo(visible(text), err=err, nl=nl)
