"""Options of ``bench retarget`` on what is edited around the method, and what they ask for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from retarget_bench.commands.options import Decorator, together

if TYPE_CHECKING:
    from retarget_bench.motion.editing.edits import Edits

_START = (
    "Of a source that begins with a T-pose or elsewhere: keep it, cut it off, or ease it into the motion."
)
_PATH = "keep, in-place, or the axis to travel along: x, -x, z, -z."
_HANDS = "Where the source shows no fingers and the target has them: relaxed, or as they rest."


def editing_options() -> Decorator:
    """``--start``, ``--root-motion`` and ``--hands``."""
    starts = click.Choice(["keep", "cut", "ease"])
    paths = click.Choice(["keep", "in-place", "x", "-x", "z", "-z"])
    hands = click.Choice(["relaxed", "open"])
    return together(
        click.option("--start", type=starts, default="keep", show_default=True, help=_START),
        click.option(
            "--root-motion", type=paths, default="keep", show_default=True, metavar="PATH", help=_PATH
        ),
        click.option("--hands", type=hands, default="relaxed", show_default=True, help=_HANDS),
    )


def asked_edits(options: Mapping[str, Any]) -> Edits:
    """What the ``editing_options`` ask for."""
    from retarget_bench.motion.editing.edits import Edits

    return Edits(options["start"], options["root_motion"], options["hands"])
