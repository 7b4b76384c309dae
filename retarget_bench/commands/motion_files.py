"""Options that say how motion files are read, and the reading itself."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench.commands.options import Decorator, together
from retarget_bench.commands.terminal import echo

if TYPE_CHECKING:
    from retarget_bench.motion.importer import Imported


def reading_options(side: str = "") -> Decorator:
    """Reading of a motion file: ``--unit``, ``--up``, ``--root-place``, ``--roles``, ``--take``,
    ``--body``, ``--rate``, ``--inner-positions``, ``--skeleton`` and ``--body-model``; with a side
    ``--target-unit`` and so on."""
    prefix, of = (f"--{side}-", f" of the {side}") if side else ("--", "")
    unit = f"Unit{of}: m, cm, mm, inch, cmu, or metres per unit."
    root = f"Whether places of the root{of} add to its OFFSET."
    roles = f'A TOML file of "joint" = "role"{of}, over what is found.'
    take = f"Which motion{of} in a file with several: name or number."
    body = f"Which body{of} in a file with several: name of its root, or number."
    rate = f"Frames per second that the file{of} truly has, over what it says. (--fps resamples.)"
    inner = (
        f"Drop, bake into rotations or keep (in files of the same body) what joints{of} below the root do "
        "that bones of constant length cannot. [default: drop, with a warning]"
    )
    bones = f"ASF file of the bones{of} of an AMC file. [default: the one beside it]"
    ways = click.Choice(["auto", "drop", "bake", "keep"])
    model = f"SMPL body model{of}: a .npz file, or a folder of them."
    places = click.Choice(["auto", "absolute", "relative"])
    return together(
        click.option(f"{prefix}unit", default="auto", metavar="UNIT", help=unit),
        click.option(f"{prefix}up", default="auto", metavar="AXIS", help=f"Up axis{of}: y, z, x, -y, ..."),
        click.option(f"{prefix}root-place", type=places, default="auto", help=root),
        click.option(f"{prefix}roles", metavar="FILE", help=roles),
        click.option(f"{prefix}take", metavar="NAME", help=take),
        click.option(f"{prefix}body", metavar="NAME", help=body),
        click.option(f"{prefix}rate", type=float, metavar="FPS", help=rate),
        click.option(f"{prefix}inner-positions", type=ways, default="auto", help=inner),
        click.option(f"{prefix}skeleton", metavar="FILE", help=bones),
        click.option(f"{prefix}body-model", metavar="PATH", help=model),
    )


def imported(
    path: Path, reading: Mapping[str, Any], side: str = "", fps: float | None = None, quiet: bool = False
) -> Imported:
    """A motion file, read as the ``reading_options`` of a side say; its warnings are printed, or not."""
    from retarget_bench.motion import importer
    from retarget_bench.motion.files import role_file

    prefix, option = (f"{side}_", f"--{side}-") if side else ("", "--")
    names = ("unit", "up", "root_place", "roles", "take", "body", "rate", "inner_positions", "skeleton")
    asked = {name: reading[f"{prefix}{name}"] for name in (*names, "body_model")}
    asked["root"] = asked.pop("root_place")
    asked["roles"] = asked["roles"] and role_file.read(Path(asked["roles"]))
    if side == "target" and asked["inner_positions"] == "auto":
        asked["inner_positions"] = "drop"  # without a warning: of a target only the body is used
    found = importer.load(path, **asked, fps=fps)
    for warning in () if quiet else found.findings.warnings:
        echo(f"{path}: {warning.replace('--', option)}", err=True)
    return found
