"""What the untrained methods cost per clip, beside copying rotations, in the same run.

Run it with ``python tests/benchmarks/method_speed.py [--rounds N]``. The clip is a generated walk on bodies
of different structures; the quickest of many runs counts.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from retarget_bench.api import Context
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.methods.bone_directions import plugin as BoneDirections
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.methods.ik import plugin as InverseKinematics

METHODS = {
    "copy_rotations": CopyRotations(),
    "bone_directions": BoneDirections(),
    "ik": InverseKinematics(),
    "ik[hands=false]": InverseKinematics(hands=False),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=200)
    options = parser.parse_args()
    puppets = Puppets(size="tiny")
    walk = next(info for info in puppets.cases("retarget", "cross") if info.kind == "walk")
    case, frames = puppets.load(walk), walk.frames
    best = dict.fromkeys(METHODS, float("inf"))
    for _ in range(options.rounds):
        for name, method in METHODS.items():
            start = time.perf_counter()
            method.retarget(case.source, case.target, context=Context())
            best[name] = min(best[name], time.perf_counter() - start)
    print(f"{len(case.target.skeleton)} joints, {frames} frames")
    print(f"{'':<18}{'ms':>8}{'frames/s':>12}{'x copy_rotations':>18}")
    for name, taken in best.items():
        ratio = taken / best["copy_rotations"]
        print(f"{name:<18}{1000 * taken:>8.2f}{frames / taken:>12.0f}{ratio:>18.1f}")


if __name__ == "__main__":
    main()
