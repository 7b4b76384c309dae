"""Options that say how a motion file is to be read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


def reading_options(side: str = "") -> Callable[[F], F]:
    """``--unit``, ``--up``, ``--root-place`` and ``--roles``; with a side ``--target-unit`` and so on."""
    prefix, of = (f"--{side}-", f" of the {side}") if side else ("--", "")

    def add(command: F) -> F:
        for option in (
            click.option(
                f"{prefix}roles",
                metavar="FILE",
                help=f'A TOML file of "joint" = "role"{of}, over what is found.',
            ),
            click.option(
                f"{prefix}root-place",
                type=click.Choice(["auto", "absolute", "relative"]),
                default="auto",
                help=f"Whether places of the root{of} add to its OFFSET.",
            ),
            click.option(
                f"{prefix}up", default="auto", metavar="AXIS", help=f"Up axis{of}: y, z, x, -y, ..."
            ),
            click.option(
                f"{prefix}unit",
                default="auto",
                metavar="UNIT",
                help=f"Unit{of}: m, cm, mm, inch, cmu, or metres per unit.",
            ),
        ):
            command = option(command)
        return command

    return add
