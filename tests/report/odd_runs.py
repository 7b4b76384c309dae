"""Results of toy methods on motion with odd names, and the report of them."""

from __future__ import annotations

import json
from pathlib import Path

from click.testing import CliRunner

from retarget_bench.cli import group
from retarget_bench.plugins import registry
from retarget_bench.results.store import ResultPaths
from tests.engine.small_plans import asked
from tests.in_process import run_here

HERE = Path(__file__).parent
LABEL = "<script>alert('m')</script> & \"q\""
"""What one of the methods is called."""


def ran(root: Path) -> list[ResultPaths]:
    """Results of three toy methods: one refuses all bodies, one is called ``LABEL``."""
    registry.add_file(HERE.parent / "engine" / "toys" / "toy_method.py")
    registry.add_file(HERE / "report_toys" / "odd_moves.py")
    methods = [f"toy_method[does={does}]" for does in ("noise", "positions", "picky")]
    about = {"splits": ("intra", "cross"), "metrics": ("position", "growth", "pan_contact")}
    places = run_here(asked(root, *methods, data="odd_moves", **about))
    for place in places:
        header = json.loads(place.header.read_text(encoding="utf-8"))
        if "positions" in header["method"]["label"]:
            header["method"]["label"] = LABEL
            place.header.write_text(json.dumps(header), encoding="utf-8")
    return places


def report(*arguments: object) -> str:
    """``bench report`` with these arguments; what it says. Raises what it raises."""
    return bench("report", "-r", *arguments)


def bench(*arguments: object) -> str:
    """Any command, likewise."""
    result = CliRunner().invoke(
        group, [*map(str, arguments)], catch_exceptions=False, standalone_mode=False
    )
    return result.output
