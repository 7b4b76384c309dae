"""Rooms of the puppets import in one direction only."""

from __future__ import annotations

import ast
from pathlib import Path

from retarget_bench.datasets import puppets

MAY_IMPORT = {
    "bodies": {"bodies"},
    "performances": {"performances"},
    "solver": {"solver", "bodies", "performances"},
    "corpus": {"corpus", "solver", "bodies", "performances"},
}
ROOT = Path(puppets.__file__).parent


def imported(file: Path) -> set[str]:
    """Rooms that a file imports from, its own among them."""
    modules = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = file.parents[node.level - 1].relative_to(ROOT).parts
            modules.update([*folder, *(node.module or "").split(".")][:1])
    return modules & MAY_IMPORT.keys()


def test_rooms_import_in_one_direction() -> None:
    for room, allowed in MAY_IMPORT.items():
        for file in (ROOT / room).rglob("*.py"):
            assert imported(file) <= allowed, f"{file.name} of {room} imports {imported(file) - allowed}"
    for file in ROOT.glob("*.py"):
        assert imported(file) <= ({"corpus"} if file.name == "dataset.py" else set())
