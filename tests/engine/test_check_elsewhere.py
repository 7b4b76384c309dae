"""Where the regression gate has to work besides: in a repository of its own, and in the workflows."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from retarget_bench import __version__, distribution

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


def test_the_action_as_the_page_shows_it(tmp_path):
    """The workflow of docs/check.md, word for word: the action's steps, as a runner carries them out."""
    import yaml

    page = (ROOT / "docs" / "check.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    (step,) = yaml.safe_load(shown)
    assert step["uses"].split("@") == [
        distribution.address().removeprefix("https://github.com/"),
        "v" + __version__.rpartition(".")[0],
    ]
    (accept,) = re.findall(
        r"^ {4}(bench check .*--accept \"[^\"]*\")", page.partition("own repository")[2], re.MULTILINE
    )
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    inputs = {name: each.get("default") for name, each in action["inputs"].items()} | step["with"]
    (tmp_path / "bin").mkdir()
    for name, what in {
        "pip": f'echo "$@" >> {tmp_path}/installed',
        "bench": f'{sys.executable} -m retarget_bench "$@"',
    }.items():
        shim = tmp_path / "bin" / name
        shim.write_text(f"#!/bin/sh\n{what}\n")
        shim.chmod(0o755)
    environment = os.environ | {
        "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "GITHUB_ACTION_PATH": str(ROOT),
        "GITHUB_STEP_SUMMARY": str(tmp_path / "summary.md"),
    }

    def steps(**more: str) -> list[int]:
        codes = []
        for each in action["runs"]["steps"]:
            inside = inputs | more
            given = {
                key: re.sub(
                    r"\$\{\{ inputs\.(\w+) \}\}", lambda found, inside=inside: inside[found[1]], value
                )
                for key, value in each.get("env", {}).items()
            }
            shell = {"bash": ["bash", "-eo", "pipefail", "-c"], "python": [sys.executable, "-c"]}[
                each["shell"]
            ]
            command = [*shell, each["run"]]
            codes.append(subprocess.run(command, cwd=tmp_path, env=environment | given).returncode)
        return codes

    for command in ("bench new method my_method", accept):
        subprocess.run(["bash", "-c", command], cwd=tmp_path, env=environment, check=True)
    assert steps() == [0, 0]
    assert (tmp_path / "installed").read_text().startswith(f"install {ROOT} ")
    method = tmp_path / "my_method.py"
    method.write_text(method.read_text().replace("stride: float = 1.0", "stride: float = 1.1"))
    assert steps() == [0, 1]
    (less,) = re.findall(r"^ {4}bench check -m my_method.py -r golden (--columns.*)$", page, re.MULTILINE)
    assert steps(options=less) == [0, 1]
    assert steps(options="--columns 'contact recall' --worse-only --tolerance 50%") == [0, 0]
    heads = re.findall("### bench check: (.*)", (tmp_path / "summary.md").read_text())
    assert heads == ["same", "moved", "moved", "same"]


WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_workflows_are_workflows(path):
    import yaml

    workflow = yaml.safe_load(path.read_text())
    on = set(workflow[True])  # YAML reads the key "on" as true
    other = {"nightly.yml": {"schedule"}, "release.yml": {"push", "workflow_dispatch"}}
    assert on >= other.get(path.name, {"push", "pull_request"})
    for job in workflow["jobs"].values():
        assert job["runs-on"]
        assert all(("uses" in step) != ("run" in step) for step in job["steps"])
