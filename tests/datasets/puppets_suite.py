"""The quality suite of the puppets: its files, and whether it has passed on the generator as it is.

``python -m tests.datasets.puppets_suite`` runs it and, when it passes, stores the hash that lets later runs
leave it out. With ``-m "slow or not slow"``, as at night, and for files that are named, it always runs.
"""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

from retarget_bench.plugins.code_hash import code_hash, relative_to

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
FILES = tuple(
    f"test_puppets_{name}.py"
    for name in (
        "between",
        "bodies",
        "copies",
        "dogs",
        "gestures",
        "locomotion",
        "matched",
        "meshes",
        "quality",
    )
)
PASSED = HERE / "puppets_suite.txt"
"""The hash of what was measured and of the tests that did it, when all of them last passed."""


@cache
def state() -> str:
    """Hash of the statements of the generator, of the engine's motion package and of the suite."""
    folders = (ROOT / "datasets" / "puppets", ROOT / "retarget_bench" / "motion")
    sources = [p for folder in folders for p in folder.rglob("*") if p.suffix in (".py", ".json")]
    return code_hash(relative_to(ROOT, [*sources, *(HERE / name for name in FILES)]))


def left_out(markers: str) -> bool:
    """Whether a run with this ``-m`` leaves the suite out."""
    return markers == "not slow" and PASSED.is_file() and PASSED.read_text().strip() == state()


def main() -> int:
    files = [str(HERE / name) for name in FILES]
    failed = subprocess.run([sys.executable, "-m", "pytest", *files, *sys.argv[1:]], cwd=ROOT).returncode
    if not failed:
        PASSED.write_text(f"{state()}\n")
    return failed


if __name__ == "__main__":
    sys.exit(main())
