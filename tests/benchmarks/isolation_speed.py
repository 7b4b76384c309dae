"""The main job with methods in processes of their own, against an earlier version without, in turns.

    python tests/benchmarks/isolation_speed.py --against f5d4c69 [--repeats 3] [-- copy_rotations ik]

Both versions run from their own checkouts with the same interpreter and a cache that is warm. Wall and
processor time (of all processes) of each run, and the ratios of the medians.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parents[2]


def measured(checkout: Path, out: Path, methods: list[str]) -> tuple[float, float]:
    """(seconds, processor seconds) of ``bench run`` in a checkout."""
    line = [sys.executable, "-m", "retarget_bench", "run", *methods, "--out", str(out)]
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    subprocess.run(line, cwd=checkout, env=environment, check=True, capture_output=True)
    seconds, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return seconds, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--against", required=True, metavar="REVISION")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("methods", nargs="*")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        earlier = Path(folder) / "earlier"
        add = ["git", "worktree", "add", "--detach", str(earlier), asked.against]
        subprocess.run(add, cwd=HERE, check=True, capture_output=True)
        try:
            times: dict[str, list[tuple[float, float]]] = {"earlier": [], "now": []}
            for number in range(-1, asked.repeats):
                for name, checkout in (("earlier", earlier), ("now", HERE)):
                    found = measured(checkout, Path(folder) / f"{name}-{number}", asked.methods)
                    if number >= 0:  # the one before fills the cache
                        times[name].append(found)
                        print(f"{name:8} {found[0]:6.1f} s, processors {found[1]:6.1f} s", flush=True)
        finally:
            remove = ["git", "worktree", "remove", "--force", str(earlier)]
            subprocess.run(remove, cwd=HERE, check=True, capture_output=True)
    for index, what in enumerate(("wall", "processor")):
        middle = {name: statistics.median(each[index] for each in found) for name, found in times.items()}
        print(f"{what}: {middle['now'] / middle['earlier']:.2f} of the earlier time")


if __name__ == "__main__":
    main()
