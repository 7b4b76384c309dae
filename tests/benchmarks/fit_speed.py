"""Rotations from joint positions: ours, upc-pymotion and SciPy's least squares, side by side.

    python tests/benchmarks/fit_speed.py [--noise 0 0.005 0.02] [--frames 600] [--repeats 5]

Right answers of the tiny puppets (one clip of every structure), known to the contenders by positions alone,
as they are and with noise (metres, in every coordinate). Of each: the root mean square distance that is
left to the positions given and to the true ones, the mean angle to the true orientations of all joints that
carry a bone, and the largest turn of such a joint from frame to frame beside the true one (flips show).
pymotion aligns the first bone of a joint and rolls to the others, from the root outward; SciPy solves the
same least squares as ours, frame by frame from pymotion's answer, for the first few frames of each clip.

Then the time per frame of a clip that is played to and fro, and how ours grows with frames and joints.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from importlib.metadata import version

import numpy as np
from pymotion.ops import skeleton_np as pymotion
from scipy.optimize import least_squares

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.fitting.fit import fit
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import registry

FEW = 4
"""Frames of each clip that SciPy is asked for: it takes a second for each."""
Solver = Callable[[Character, np.ndarray], Motion]


def ours(body: Character, places: np.ndarray) -> Motion:
    return fit(body.positions(places, 30.0)).motion


def by_pymotion(body: Character, places: np.ndarray) -> Motion:
    root, skeleton = places[:, 0], body.skeleton
    offsets = np.array(skeleton.offsets)
    offsets[0] = 0.0
    with np.errstate(all="ignore"):  # bones of no length
        turned = pymotion.from_root_positions(places - root[:, None], np.array(skeleton.parents), offsets)
    return body.motion(rotation.normalise(np.nan_to_num(turned)), root, 30.0)


def by_scipy(body: Character, places: np.ndarray) -> Motion:
    skeleton, start = body.skeleton, by_pymotion(body, places)
    found = []
    for frame, seen in enumerate(places):

        def off(vectors: np.ndarray, seen: np.ndarray = seen) -> np.ndarray:
            local = rotation.from_rotation_vector(vectors.reshape(-1, 3))
            return (kinematics.forward(skeleton, local, seen[0])[0] - seen).ravel()

        vectors = rotation.to_rotation_vector(start.rotations[frame]).ravel()
        found.append(rotation.from_rotation_vector(least_squares(off, vectors).x.reshape(-1, 3)))
    return body.motion(np.stack(found), places[:, 0], 30.0)


SOLVERS: dict[str, Solver] = {"ours": ours, "pymotion": by_pymotion, "scipy": by_scipy}


# ------------------------------------------------------------------------------------------- accuracy
def clips() -> list[Motion]:
    """One right answer of every structure."""
    data = registry.create("datasets", "puppets[size=tiny]")
    found: dict[str, Motion] = {}
    for info in data.cases("retarget", "intra"):
        if (structure := data.characters()[info.target].structure) not in found:
            found[structure] = data.load(info).reference.resample(30.0)
    return list(found.values())


def told(name: str, motions: list[Motion], noise: float) -> list[float]:
    """Root mean square centimetres to what was given and to the truth, degrees of error, and of steps."""
    sums: list[list[float]] = []
    for motion in motions:
        true = motion.at(slice(0, FEW)) if name == "scipy" else motion
        drawn = noise * np.random.default_rng(0).normal(size=motion.positions.shape)
        given = true.positions + drawn[: true.frames]
        found = SOLVERS[name](motion.character, given)
        inner = [joint for joint, below in enumerate(motion.skeleton.children) if below]
        off = [np.square(found.positions - each).sum(axis=2).mean() for each in (given, true.positions)]
        apart = rotation.angle(found.global_rotations, true.global_rotations)[:, inner]
        turned = [
            rotation.angle(m.rotations[1:, inner], m.rotations[:-1, inner]).max() for m in (found, true)
        ]
        sums.append([*(100 * np.sqrt(off)), np.degrees(apart.mean()), *np.degrees(turned)])
    means = np.mean(sums, axis=0)
    return [*means[:3], *np.max(sums, axis=0)[3:]]


def accuracy(noises: list[float]) -> None:
    motions = clips()
    print(f"{len(motions)} clips of {', '.join(motion.character.structure for motion in motions)}")
    print(f"{'':24}{'cm given':>10}{'cm true':>9}{'degrees':>9}{'largest step':>14}{'true':>7}")
    for noise in noises:
        for name in SOLVERS:
            given, true, angle, step, real = told(name, motions, noise)
            label = f"noise {100 * noise:g} cm, {name}"
            print(f"{label:24}{given:10.3f}{true:9.3f}{angle:9.1f}{step:14.1f}{real:7.1f}")


# ------------------------------------------------------------------------------------------------ time
def to_and_fro(motion: Motion, frames: int) -> np.ndarray:
    """``(frames, joints, 3)`` positions of a motion that is played forward and back."""
    there = np.concatenate([motion.positions, motion.positions[-2:0:-1]])
    return np.resize(there, (frames, *there.shape[1:]))


def speed(frames: int, repeats: int) -> None:
    motion = max(clips(), key=lambda each: len(each.skeleton))
    noise, true = (
        np.random.default_rng(1).normal(size=(frames, len(motion.skeleton), 3)),
        to_and_fro(motion, frames),
    )
    places = {"exact": true, "5 mm of noise": true + 0.005 * noise, "30 cm of noise": true + 0.3 * noise}
    for kind, seen in places.items():
        taken: dict[str, list[float]] = {name: [] for name in SOLVERS}
        for _ in range(repeats):
            for name, solve in SOLVERS.items():
                some = seen[:2] if name == "scipy" else seen
                start = time.process_time()
                solve(motion.character, some)
                taken[name].append((time.process_time() - start) / len(some))
        for name, each in taken.items():
            ratio = statistics.median(a / b for a, b in zip(each, taken["ours"], strict=True))
            rate = 1.0 / statistics.median(each)
            print(
                f"{len(motion.skeleton)} joints, {kind}, {name:10}{rate:9.0f} frames/s{ratio:9.2f} x ours"
            )


def growth() -> None:
    """Trees of random bones, positions with 5 mm of noise."""
    for joints, frames in ((25, 500), (50, 500), (100, 500), (200, 500), (25, 2000), (25, 8000)):
        draw = np.random.default_rng(joints)
        parents = np.array([-1, *(max(0, joint - int(draw.integers(1, 4))) for joint in range(1, joints))])
        names = tuple(f"joint{k}" for k in range(joints))
        body = Character.of("tree", Skeleton(names, parents, 0.2 * draw.normal(size=(joints, 3))))
        t = np.arange(frames)[:, None, None] / 30.0
        turns = 0.3 * draw.normal(size=(1, joints, 3)) * np.sin(3 * t + draw.uniform(0, 6, (1, joints, 1)))
        motion = body.motion(rotation.from_rotation_vector(turns), np.zeros((frames, 3)), 30.0)
        seen = motion.positions + 0.005 * draw.normal(size=motion.positions.shape)
        start = time.process_time()
        ours(body, seen)
        taken = time.process_time() - start
        each = 1e6 * taken / frames / joints
        print(
            f"{joints:4} joints, {frames:5} frames: {frames / taken:7.0f} frames/s, {each:5.1f} us a joint"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--noise", type=float, nargs="+", default=[0.0, 0.005, 0.02], metavar="METRES")
    parser.add_argument("--frames", type=int, default=600)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    print(f"numpy {np.__version__}, upc-pymotion {version('upc-pymotion')}, scipy {version('scipy')}")
    accuracy(options.noise)
    speed(options.frames, options.repeats)
    growth()


if __name__ == "__main__":
    main()
