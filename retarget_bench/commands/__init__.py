"""The commands of ``bench``, one module each; every module has a ``command``.

Imports everything, but only inside the functions that need it, so that help stays fast.
Offers nothing to other packages.
"""

import click

from retarget_bench.errors import visible


def echo(text: str = "", *, err: bool = False, nl: bool = True) -> None:
    """Print a text, which may have several lines, and in which nothing that files and plug-ins bring steers
    the terminal. err: to the error output; nl: end the line."""
    click.echo(visible(text), err=err, nl=nl)
