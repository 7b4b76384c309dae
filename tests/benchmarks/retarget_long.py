"""What ``bench retarget`` costs on long files: seconds of processor time and the most memory it held.

    python tests/benchmarks/retarget_long.py [METHOD ...] [--minutes 0.1 1 10]

The source is a generated walk of a puppet that is walked on and on (each round begins where the last one
ended), written as a BVH file; the target is a body of another structure. Every command is a process of
its own with an empty cache. What the command itself takes (importer, writer) shows with
``copy_rotations``; of a method that works frame by frame, memory must not grow faster than that.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.motion import bvh
from retarget_bench.motion.motion import Motion

FPS = 30.0


def walked_on(motion: Motion, frames: int) -> Motion:
    """The motion over and over, each round set down where the last one ended, seen from above."""
    rounds = -(-frames // motion.frames)
    way = (motion.root[-1] - motion.root[0]) * [1.0, 0.0, 1.0]
    root = np.concatenate([motion.root + number * way for number in range(rounds)])[:frames]
    turns = np.tile(motion.rotations, (rounds, 1, 1))[:frames]
    return motion.character.motion(turns, root, motion.fps)


def cost(words: list[str], cache: Path) -> tuple[float, float]:
    """Seconds of processor time and megabytes of the largest resident set of one command."""
    environment = os.environ | {
        "RETARGET_BENCH_CACHE": str(cache),
        "PYTHONPATH": str(Path(__file__).parents[2]),
        "OMP_NUM_THREADS": "1",
    }
    line = [sys.executable, "-m", "retarget_bench", *words]
    child = os.posix_spawn(
        sys.executable,
        line,
        environment,
        file_actions=[(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)],
    )
    _, status, usage = os.wait4(child, 0)
    if status:
        raise SystemExit(f"{' '.join(line)} failed")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("methods", nargs="*", default=["copy_rotations"])
    parser.add_argument("--minutes", nargs="+", type=float, default=[0.1, 1.0, 10.0])
    options = parser.parse_args()
    puppets = Puppets(size="tiny")
    walks = [info for info in puppets.cases("retarget", "cross") if info.kind == "walk"]
    case = puppets.load(walks[0])
    assert isinstance(case.source, Motion)
    assert isinstance(case.reference, Motion)
    print(f"{'method':<32}{'minutes':>8}{'frames':>8}{'file MB':>9}{'seconds':>9}{'MB':>7}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bvh.write(folder / "target.bvh", case.reference.at(slice(0, 30)), scale=100.0)
        for method in options.methods:
            for minutes in options.minutes:
                frames = round(60 * FPS * minutes)
                source = folder / "source.bvh"
                bvh.write(source, walked_on(case.source, frames), scale=100.0)
                words = [
                    "retarget",
                    f"{source}[unit=cm]",
                    "--target",
                    f"{folder / 'target.bvh'}[unit=cm]",
                    "-m",
                    method,
                ]
                seconds, megabytes = cost(
                    [*words, "-o", str(folder / "out.bvh")], folder / f"cache-{method}-{minutes}"
                )
                assert len(bvh.read(folder / "out.bvh").root) == frames
                size = source.stat().st_size / 1e6
                print(f"{method:<32}{minutes:8g}{frames:8d}{size:9.1f}{seconds:9.2f}{megabytes:7.0f}")


if __name__ == "__main__":
    main()
