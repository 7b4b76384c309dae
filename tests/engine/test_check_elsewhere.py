"""Where the regression gate has to work besides: in a repository of its own, and in the workflows."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

TOYS = Path(__file__).parent / "toys"
ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_a_repository_of_its_own_with_a_plugin_file(tmp_path):
    """As in docs/check.md: the real command, elsewhere, twice."""
    (tmp_path / "mine.py").write_text((TOYS / "toy_learner.py").read_text().replace("toy_learner", "mine"))
    files = ["-r", "golden"]
    command = [
        sys.executable,
        "-m",
        "retarget_bench",
        "check",
        "-m",
        "mine.py",
        "-d",
        TOYS / "toy_cases.py",
    ]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}

    def run(*more, **changes):
        completed = subprocess.run(
            [*command, *files, *more],
            cwd=tmp_path,
            env=environment | changes,
            capture_output=True,
            text=True,
        )
        return completed.returncode, completed.stdout + completed.stderr

    assert run("--accept", "first rows")[0] == 0
    assert (tmp_path / "golden" / "CHANGES.md").is_file()
    assert run("--summary", "s.md")[0] == 0
    assert run("--summary", "s.md", TOY_OFF="0.5")[0] == 1
    assert re.findall("### bench check: (.*)", (tmp_path / "s.md").read_text()) == ["same", "moved"]


WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_workflows_are_workflows(path):
    import yaml

    workflow = yaml.safe_load(path.read_text())
    on = set(workflow[True])  # YAML reads the key "on" as true
    assert on >= ({"schedule"} if path.name == "nightly.yml" else {"push", "pull_request"})
    for job in workflow["jobs"].values():
        assert job["runs-on"]
        assert all(("uses" in step) != ("run" in step) for step in job["steps"])
