"""How long the puppets take to make: every motion of every case, into an empty cache.

    python tests/benchmarks/puppets_generation.py [--sizes tiny default] [--processes 2]

Prints, for every size, seconds on so many processes, frames solved per second and core, the largest
process, the cache's size, and how much faster the same motions are read back. The bars: tiny under 5 s,
default under 60 s on two cores, each process under 1.5 GB.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
import tempfile
import time
from pathlib import Path

BARS = {"tiny": 5.0, "default": 60.0}
MEMORY = 1.5e9


def performed(size: str) -> list[tuple[str, str, str]]:
    """(clip, body, manner) of all motions that the cases of a size consist of, long clips first."""
    from retarget_bench.datasets.puppets.contract import SECOND, USUAL
    from retarget_bench.datasets.puppets.corpus.cases import performers

    found = []
    for clip, (names, targets) in performers(size, "test", 0).items():
        manners = [(USUAL, names), (SECOND, targets)]
        found += [(clip.frames, clip.name, name, how) for how, chosen in manners for name in chosen]
    return [row[1:] for row in sorted(found, key=lambda row: -row[0])]


def make(job: tuple[str, str, str, str]) -> tuple[int, float, int]:
    """Solve or read one motion: its frames, the seconds it took, the process' largest memory in bytes."""
    from retarget_bench.datasets.puppets.corpus.generated import Generated

    size, clip, name, manner = job
    data = CORPORA.setdefault(size, Generated(size))
    start = time.process_time()
    frames = data.motion(clip, name, manner).frames
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return frames, time.process_time() - start, peak


CORPORA: dict[str, object] = {}
"""Of this process."""


def timed(jobs: list[tuple[str, str, str, str]], processes: int) -> tuple[float, float, int, int]:
    """Wall seconds with the processes' start, seconds of work, frames, bytes of the largest process."""
    start = time.perf_counter()
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        done = pool.map(make, jobs, chunksize=4)
    wall = time.perf_counter() - start
    return wall, sum(row[1] for row in done), sum(row[0] for row in done), max(row[2] for row in done)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--sizes", nargs="+", default=list(BARS), choices=list(BARS))
    parser.add_argument("--processes", type=int, default=2)
    asked = parser.parse_args()
    # one thread a process, as in bench run
    os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    for size in asked.sizes:
        jobs = [(size, *row) for row in performed(size)]
        with tempfile.TemporaryDirectory() as folder:
            os.environ["RETARGET_BENCH_CACHE"] = folder
            wall, work, frames, peak = timed(jobs, asked.processes)
            stored = sum(path.stat().st_size for path in Path(folder).rglob("*.npz"))
            read = timed(jobs, asked.processes)[1]
        verdict = "held" if wall < BARS[size] and peak < MEMORY else "MISSED"
        print(
            f"{size}: {len(jobs)} motions, {frames} frames in {wall:.1f} s on {asked.processes} processes "
            f"({work:.1f} s of work, {frames / work:.0f} frames a second and core), largest process "
            f"{peak / 1e6:.0f} MB, cache {stored / 1e6:.0f} MB; read back {work / read:.0f} times as fast. "
            f"Bars of {BARS[size]:.0f} s and {MEMORY / 1e9:g} GB: {verdict}."
        )


if __name__ == "__main__":
    main()
