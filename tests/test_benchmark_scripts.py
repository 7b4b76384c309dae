"""The scripts that our numbers come from are run by hand: what they take from us must still be there."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest

SCRIPTS = sorted((Path(__file__).parent / "benchmarks").glob("*.py"))


def taken(text: str) -> Iterator[tuple[str, str]]:
    """Module and name of every import from this package, those inside functions too."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "retarget_bench":
            yield from ((node.module, each.name) for each in node.names)


def is_there(module: str, name: str) -> bool:
    if hasattr(importlib.import_module(module), name):
        return True
    try:
        importlib.import_module(f"{module}.{name}")
    except ModuleNotFoundError:
        return False
    return True


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_what_a_script_imports_is_there(script):
    every = taken(script.read_text(encoding="utf-8"))
    assert [".".join(each) for each in every if not is_there(*each)] == []


def test_what_is_not_there_is_told():
    text = (
        "from retarget_bench.evaluation import plan\n"
        "def f():\n"
        "    from retarget_bench.files import nothing, digest"
    )
    assert [is_there(*each) for each in taken(text)] == [True, False, True]
