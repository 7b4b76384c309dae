"""The plan that tests of running stand on: toy methods on the intra cases of a toy data set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from retarget_bench import records, run
from retarget_bench.plan import Plan
from retarget_bench.spec import Spec


def asked(root: Path, *methods: str, clips: int = 3, **changes: Any) -> Plan:
    """changes: any fields of the plan."""
    return Plan(
        methods=tuple(map(Spec.parse, methods)),
        root=root,
        **{
            "datasets": (Spec.parse(f"toy_cases[clips={clips}]"),),
            "splits": ("intra",),
            "metrics": ("position",),
            **changes,
        },
    )


def carry_out(*args: Any, **changes: Any) -> list[records.Results]:
    """What comes of ``asked(*args, **changes)``."""
    places = run.run(asked(*args, **changes), lambda done, total: None)
    return [records.read_results(place) for place in places]
