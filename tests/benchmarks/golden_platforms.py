"""How far golden rows are from being moved by another processor: the gate with other instructions.

    PYTHONPATH=. python tests/benchmarks/golden_platforms.py

Each run starts from an empty cache, so that the puppets are generated with these instructions too. Printed
is what moved by more than it may. Another version of NumPy: run it with that one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

AVX512 = "X86_V4 AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL"
"""By the names of NumPy 2.4 and of earlier ones."""
SETTINGS = {
    "as it is": {},
    "no AVX-512": {"NPY_DISABLE_CPU_FEATURES": AVX512, "OPENBLAS_CORETYPE": "Haswell"},
    "no vector instructions": {
        "NPY_DISABLE_CPU_FEATURES": f"{AVX512} X86_V3 AVX2 FMA3",
        "OPENBLAS_CORETYPE": "Prescott",
    },
}


def measure() -> None:
    """One run in this process; prints the verdict, how much was compared, and what moved as JSON."""
    from retarget_bench.verification.gate import golden, run

    with tempfile.TemporaryDirectory() as scratch:
        found, _ = run.check(golden.built_in(), Path(scratch), (), None, lambda done, total: None)
    moved = [" ".join((each.subject, each.where, each.value)) for each in found.changes]
    print(json.dumps([found.verdict, found.compared, moved]))


def main() -> None:
    import numpy as np

    print(f"NumPy {np.__version__}, Python {sys.version.split()[0]}")
    for name, changes in SETTINGS.items():
        with tempfile.TemporaryDirectory() as cache:
            done = subprocess.run(
                [sys.executable, "-W", "ignore", __file__, "measure"],
                env=os.environ | changes | {"RETARGET_BENCH_CACHE": cache},
                capture_output=True,
                text=True,
                check=True,
            )
        verdict, compared, moved = json.loads(done.stdout.splitlines()[-1])
        print(f"{name}: exit status {verdict}, {compared} compared, moved: {', '.join(moved) or 'nothing'}")


if __name__ == "__main__":
    measure() if sys.argv[1:] == ["measure"] else main()
