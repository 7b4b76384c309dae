"""What ``bench retarget`` costs on ten minutes of motion, from every format to every format.

    python tests/benchmarks/ten_minutes.py [--frames 18000] [--method copy_rotations] [--acclaim FILE.amc]

Every pair of a source's format and a target's is a command of its own, on one thread, with an empty cache:
seconds of processor time, processes that it starts included, and the most memory that one of them held.
Sources: a puppet's walk, walked on and on, as BVH, GLB and FBX, a dance as AMASS and as joint positions,
and with --acclaim the frames of an AMC file over and over. Targets: another puppet as BVH and, with its
mesh, as GLB, and a body of SMPL as AMASS.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.motion import bvh
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.files import writing
from retarget_bench.motion.files.smpl import average
from retarget_bench.motion.files.smpl.families import BODY, SMPLH
from tests.benchmarks.retarget_long import walked_on
from tests.motion import fbx_files, smpl_files

SECONDS, MEGABYTES = 10.0, 300.0
"""What a command may take."""
_DATA = ":DEGREES"


def sources(folder: Path, walk: Motion, frames: int, acclaim: Path | None) -> list[Path]:
    """One long file of each format."""
    random = np.random.default_rng(0)
    long = walked_on(walk, frames)
    bvh.write(folder / "walk.bvh", long, scale=100.0)
    writing.write(folder / "walk.glb", long)
    made = fbx_files.of_recording(bvh.read(folder / "walk.bvh"))
    (folder / "walk.fbx").write_bytes(fbx_files.binary(made.nodes()))
    smpl_files.archive(folder / "dance.npz", smpl_files.parameters(random, SMPLH, frames))
    np.save(folder / "dance.npy", smpl_files.danced(Character.of("body", average.skeleton(BODY)), frames))
    found = [folder / name for name in ("walk.bvh", "walk.glb", "walk.fbx", "dance.npz", "dance.npy")]
    if acclaim is not None:
        found.append(taken_on(acclaim, folder, frames))
    return found


def taken_on(acclaim: Path, folder: Path, frames: int) -> Path:
    """An AMC file whose frames come over and over, with its bones beside it."""
    head, _, body = acclaim.read_text().partition(_DATA)
    rows = body.split("\n1\n", 1)[1].split("\n")
    size = next(at for at, line in enumerate(rows) if line.strip() == "2")
    count = (len(rows) + 1) // (size + 1)
    lines = [rows[k * (size + 1) : k * (size + 1) + size] for k in range(count)]
    text = "".join(f"{n + 1}\n" + "\n".join(lines[n % count]) + "\n" for n in range(frames))
    (folder / acclaim.name).write_text(f"{head}{_DATA}\n{text}")
    for bones in acclaim.parent.glob("*.asf"):
        shutil.copy(bones, folder)
    return folder / acclaim.name


def cost(words: list[str], cache: Path) -> tuple[float, float]:
    """Seconds of processor time and megabytes of the largest process of a command."""
    root = str(Path(__file__).parents[2])
    extra = {"RETARGET_BENCH_CACHE": str(cache), "PYTHONPATH": root, "OMP_NUM_THREADS": "1"}
    child = os.fork()
    if not child:  # a process between, whose children are those of the command alone
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        command = [sys.executable, "-m", "retarget_bench", *words]
        status = os.spawnve(os.P_WAIT, sys.executable, command, os.environ | extra)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        (cache.parent / "cost").write_text(f"{used.ru_utime + used.ru_stime} {used.ru_maxrss / 1024}")
        os._exit(status)
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]):
        raise SystemExit(f"{' '.join(words)} failed")
    seconds, megabytes = (cache.parent / "cost").read_text().split()
    return float(seconds), float(megabytes)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=18_000)
    parser.add_argument("--method", default="copy_rotations")
    parser.add_argument("--acclaim", type=Path)
    given = parser.parse_args()
    puppets = Puppets(size="tiny")
    case = puppets.load(next(i for i in puppets.cases("retarget", "cross") if i.kind == "walk"))
    assert isinstance(case.source, Motion)
    assert isinstance(case.reference, Motion)
    worst = [0.0, 0.0]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        long = sources(folder, case.source, given.frames, given.acclaim)
        for ending in (".bvh", ".glb"):
            writing.write(folder / f"target{ending}", case.reference.at(slice(0, 30)))
        smpl_files.archive(folder / "target.npz", smpl_files.parameters(np.random.default_rng(1), SMPLH, 2))
        print(f"{'from':<8}{'to':<8}{'seconds':>9}{'MB':>7}")
        for source in long:
            for target in (folder / f"target{ending}" for ending in (".bvh", ".glb", ".npz")):
                out = folder / f"out{target.suffix}"
                words = [
                    "retarget",
                    str(source),
                    "--target",
                    str(target),
                    "-o",
                    str(out),
                    "-m",
                    given.method,
                ]
                found = cost([*words, "--quiet"], folder / "cache")
                shutil.rmtree(folder / "cache", ignore_errors=True)
                worst = [max(pair) for pair in zip(worst, found, strict=True)]
                print(f"{source.suffix:<8}{target.suffix:<8}{found[0]:>9.1f}{found[1]:>7.0f}", flush=True)
    print(f"worst: {worst[0]:.1f} s of {SECONDS:g}, {worst[1]:.0f} MB of {MEGABYTES:g}")


if __name__ == "__main__":
    main()
