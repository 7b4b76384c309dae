"""Speed of reading BVH files, against the readers on PyPI, on the same files in the same run.

    python benchmarks/bvh_reading.py PATH/TO/DATA [--every 4] [--rounds 3]

In every round the readers take turns, each with all the files that it can read, as a loader of a data set
does. A file counts with the best of its rounds. Ratios compare a reader with ours over the files that it
can read. All readers must find the same number of frames. "no cache" parses the text each time; "cached"
finds what an earlier read has kept on disk.
"""

from __future__ import annotations

import argparse
import math
import os
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bvh as bvh_python
import pybvh
from pymotion.io.bvh import BVH

from retarget_bench.motion import bvh

UNCACHED, CACHED = "ours, no cache", "ours, cached"
Reader = Callable[[Path], Any]


def pymotion(path: Path) -> BVH:
    reader = BVH()
    reader.load(str(path))
    return reader


# name -> how it reads a file, and how many frames it found
READERS: dict[str, tuple[Reader, Callable[[Any], int]]] = {
    UNCACHED: (lambda path: bvh.parse(path, cache=False), lambda parsed: parsed.frames),
    CACHED: (bvh.parse, lambda parsed: parsed.frames),
    "pybvh": (pybvh.read_bvh_file, lambda parsed: parsed.frame_count),
    "upc-pymotion": (pymotion, lambda parsed: len(parsed.data["rotations"])),
    "bvh": (lambda path: bvh_python.Bvh(path.read_text()), lambda parsed: len(parsed.frames)),
}


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("data", type=Path, help="folder of BVH files")
    arguments.add_argument("--every", type=int, default=1, help="read every n-th file only")
    arguments.add_argument("--rounds", type=int, default=3)
    options = arguments.parse_args()
    files = sorted(options.data.rglob("*.bvh"))[:: options.every]
    if not files:
        raise SystemExit(f"no BVH files below {options.data}")
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as cache:
        os.environ["RETARGET_BENCH_CACHE"] = cache
        show(files, measure(files, options.rounds))


def measure(files: list[Path], rounds: int) -> dict[str, dict[Path, float]]:
    """Reader -> file -> best seconds, for the files that the reader can read."""
    frames = {path: bvh.parse(path).frames for path in files}
    best: dict[str, dict[Path, float]] = {}
    for name, (read, count) in READERS.items():
        best[name] = {path: math.inf for path in files if finds(read, count, path) == frames[path]}
    for _ in range(rounds):
        for name, (read, _count) in READERS.items():
            for path in best[name]:
                begun = time.perf_counter()
                read(path)
                best[name][path] = min(best[name][path], time.perf_counter() - begun)
    return best


def finds(read: Reader, count: Callable[[Any], int], path: Path) -> int:
    """The number of frames that a reader finds, or -1 where it gives up, in whatever way."""
    try:
        return count(read(path))
    except Exception:
        return -1


def show(files: list[Path], best: dict[str, dict[Path, float]]) -> None:
    print(f"{len(files)} files, {sum(path.stat().st_size for path in files) / 1e6:.0f} MB")
    print(f"{'reader':16}{'files':>7}{'MB/s':>8}   times faster: {UNCACHED:>14}{CACHED:>14}")
    for name, times in best.items():
        size = sum(path.stat().st_size for path in times) / 1e6
        total = sum(times.values())
        uncached, cached = (sum(best[each][path] for path in times) for each in (UNCACHED, CACHED))
        print(f"{name:16}{len(times):7}{size / total:8.0f}{total / uncached:32.1f}{total / cached:14.1f}")


if __name__ == "__main__":
    main()
