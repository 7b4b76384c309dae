"""How long ten minutes of motion in files of SMPL take from format to format, and how much memory.

    python tests/benchmarks/smpl_files.py [--frames 18000]

Every pair of formats is a process of its own, on one thread: seconds of processor time to read and to
write, and the largest memory that it ever held. Joint positions are those of a walking body with noise of
3 mm, which is what the fit of rotations takes longest for.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parents[1]
WORK = """
import resource, sys, time
from pathlib import Path
from retarget_bench.motion import importer
from retarget_bench.motion.files import writing
start = time.process_time()
found = importer.load(sys.argv[1])
read = time.process_time()
writing.write(Path(sys.argv[2]), found.motion, found)
held = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(f"{read - start:6.1f} {time.process_time() - read:6.1f} {held:6.0f}")
"""
PAIRS = (
    *(("smpl.npz", ".npz"), ("smplh.npz", ".npz"), ("smplx.npz", ".npz"), ("smplx.npz", ".bvh")),
    *(("smplx.npz", ".glb"), ("joints.npy", ".npz"), ("joints.npy", ".bvh"), ("features.npy", ".npz")),
)


def made(folder: Path, frames: int) -> None:
    """One file of each format."""
    sys.path[:0] = [str(HERE / "motion"), str(HERE.parent)]
    from smpl_files import archive, danced, features, parameters

    from retarget_bench.motion.character import Character
    from retarget_bench.motion.files.smpl import average
    from retarget_bench.motion.files.smpl.families import BODY, SMPL, SMPLH, SMPLX

    random = np.random.default_rng(0)
    for family in (SMPL, SMPLH, SMPLX):
        archive(folder / f"{family.word}.npz", parameters(random, family, frames))
    joints = danced(Character.of("body", average.skeleton(BODY)), frames + 1)
    np.save(folder / "joints.npy", joints[1:] + 0.003 * random.normal(size=joints[1:].shape))
    np.save(folder / "features.npy", features(joints, np.cumsum(np.full(frames + 1, 0.01))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=18_000)
    asked = parser.parse_args()
    environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(HERE.parent)}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made(folder, asked.frames)
        print(f"{'from':14} {'to':5} read s write s     MB")
        for source, ending in PAIRS:
            command = [sys.executable, "-c", WORK, str(folder / source), str(folder / f"out{ending}")]
            done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
            print(f"{source:14} {ending:5} {done.stdout.strip()}")


if __name__ == "__main__":
    main()
