"""The scripts that our numbers come from are run by hand: what they take from us must still be there."""

from __future__ import annotations

import ast
import importlib
import json
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPTS = sorted(ROOT.glob("benchmarks/*.py"))
BEGUN = """
import contextlib, io, json, os, runpy, sys
found = {}
for script in sys.argv[1:]:
    parses = "ArgumentParser(" in open(script, encoding="utf-8").read()
    path, sys.argv = list(sys.path), [script, "--help"]
    sys.path.insert(0, os.path.dirname(script))
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            runpy.run_path(script, run_name="__main__" if parses else "begun")
    except SystemExit as stop:
        found[script] = "" if stop.code == 0 else f"status {stop.code}"
    except ModuleNotFoundError as error:
        found[script] = f"no {error.name.split('.')[0]}"
    except Exception as error:
        found[script] = repr(error)
    sys.path[:] = path
print(json.dumps(found))
"""
"""In a process of its own: asks scripts with options for help, and imports the others; what went wrong."""


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


@pytest.mark.slow
def test_every_script_begins():
    """Those that compare with other packages need these: they may be missing, and nothing else may."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert len(project["optional-dependencies"]["benchmark"]) == 4
    others = {f"no {name}" for name in ("bvh", "pybvh", "pytorch_kinematics", "pymotion")}
    line = [sys.executable, "-c", BEGUN, *map(str, SCRIPTS)]
    completed = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=True)
    wrong = json.loads(completed.stdout.splitlines()[-1])
    assert {script: message for script, message in wrong.items() if message and message not in others} == {}
