"""What tests of running stand on: toy plug-ins, and a plan of toy methods on the intra cases of toys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from retarget_bench.evaluation import runner
from retarget_bench.evaluation.plan import Plan
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store

HERE = Path(__file__).parent
TOYS = HERE / "toys"


def know_toys() -> None:
    """Register all toys that do nothing wrong."""
    for folder in ("toys", "batch_toys", "post_toys", "set_toys", "shard_toys", "split_toys"):
        for file in sorted((HERE / folder).glob("*.py")):
            registry.add_file(file)


def asked(root: Path, *methods: str, clips: int = 3, data: str = "", **changes: Any) -> Plan:
    """data: another data set than the toy one. changes: any fields of the plan."""
    return Plan(
        methods=tuple(map(Spec.parse, methods)),
        out=root,
        **{
            "datasets": (Spec.parse(data or f"toy_cases[clips={clips}]"),),
            "splits": ("intra",),
            "metrics": ("position",),
            **changes,
        },
    )


def carry_out(*args: Any, **changes: Any) -> list[store.Results]:
    """What comes of ``asked(*args, **changes)``."""
    places = runner.run(asked(*args, **changes), lambda done, total: None)
    return [store.read_results(place) for place in places]
