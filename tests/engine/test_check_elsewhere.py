"""Where the regression gate has to work besides: in a repository of its own, and in the workflows."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_workflows_test_every_python_that_is_promised_and_run_the_gate():
    import yaml

    ci, check = (yaml.safe_load((ROOT / ".github/workflows" / name).read_text()) for name in
                 ("ci.yml", "check.yml"))  # fmt: skip
    assert ci["jobs"]["test"]["strategy"]["matrix"]["python"] == ["3.11", "3.12", "3.13"]
    steps = [step.get("run", "") for step in ci["jobs"]["test"]["steps"]]
    assert any(step.startswith("make test") for step in steps)
    assert 'bench check --summary "$GITHUB_STEP_SUMMARY"' in [
        step.get("run") for step in check["jobs"]["check"]["steps"]
    ]
    assert re.search(r"^\t\$\(MAKE\).* check$", (ROOT / "Makefile").read_text(), re.MULTILINE)
