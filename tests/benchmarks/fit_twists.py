"""Twists that the fit chooses, beside those of real files: joint positions in, rotations out.

    python tests/benchmarks/fit_twists.py [--root DIR] [--frames 600]

For every rig two clips: one is the sample that tells how the rig is made, the other's joint positions are
fitted. Degrees between the rotations that come out and those of the file, means over frames, left and right
and all clips: in the world, and of these how far the bone itself points elsewhere (swing) and how far it is
turned about itself (twist). "before" is with the elbow's axis of bodies in general, "after" with the one
that the sample shows (``retarget_bench/motion/hinges.py``). Needs the real data ($RETARGET_BENCH_DATA).
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from retarget_bench.motion import importer, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.fitting.fit import Fitted, fit
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.roles import SIDES

RIGS = {
    "LAFAN1": ("lafan1/fallAndGetUp3_subject1.bvh", "lafan1/dance1_subject1.bvh"),
    "CMU (cgspeed)": ("cmu_bvh/131_01.bvh", "cmu_bvh/131_02.bvh"),
    "CMU (iClone)": ("cmu_iclone/002_03.bvh", "cmu_iclone/005_03.bvh"),
    "Bandai Namco": (
        "bandai_namco/dataset-1_punch_normal_001.bvh",
        "bandai_namco/dataset-1_dash_giant_001.bvh",
    ),
    "Mixamo, Aj": ("mixamo_san/Aj/Rifle Block.bvh", "mixamo_san/Aj/Running.bvh"),
    "Mixamo, Ortiz": (
        "mixamo_r2et/Ortiz/House Dancing.bvh",
        "mixamo_r2et/Ortiz/Macarena Dance.bvh",
    ),
    "SFU (same_pairs)": ("same_pairs/SFU/0005_JumpRope001_0.bvh",) * 2,
}
JOINTS = ("shoulder", "arm", "forearm", "up_leg", "leg", "foot")


def on(character: Character, motion: Motion) -> Motion:
    """A clip of the same rig on the body that another clip told of."""
    return character.motion(motion.rotations, motion.root, motion.fps)


def apart(true: Motion, found: Motion, role: str) -> tuple[float, float, float] | None:
    """Degrees in the world, of swing, and of twist about the longest bone; None where there is none."""
    joint, lengths = true.character.joint_of.get(role, -1), true.skeleton.bone_lengths
    below = sorted(true.skeleton.children[joint] if joint >= 0 else (), key=lambda child: -lengths[child])
    if not below:
        return None
    turns = [motion.global_rotations[:, joint] for motion in (true, found)]
    bones = [rotation.rotate(turned, true.skeleton.offsets[below[0]]) for turned in turns]
    swing = rotation.between(bones[1], bones[0])
    twisted = rotation.multiply(swing, turns[1])
    parts = [
        rotation.angle(*turns),
        rotation.angle(swing, rotation.identity()),
        rotation.angle(twisted, turns[0]),
    ]
    whole, swung, twist = (float(np.degrees(each.mean())) for each in parts)
    return whole, swung, twist


def rows(true: Motion, fitted: Fitted) -> Iterator[tuple[str, np.ndarray]]:
    for part in JOINTS:
        told = [apart(true, fitted.motion, f"{side}_{part}") for side in SIDES]
        if known := [each for each in told if each is not None]:
            yield part, np.mean(known, axis=0)


def largest_step(motion: Motion) -> float:
    """Degrees: the largest turn of a joint that carries a bone from one frame to the next."""
    inner = [joint for joint, below in enumerate(motion.skeleton.children) if below]
    turned = motion.rotations[:, inner]
    return float(np.degrees(rotation.angle(turned[1:], turned[:-1]).max()))


def told(root: Path, name: str, frames: int) -> None:
    sample, clip = (importer.load(root / file).motion for file in RIGS[name])
    after = on(sample.character, clip.at(slice(0, frames)))
    before = on(replace(sample.character, hinges={}), after)
    found, taken = [], []
    for motion in (before, after):
        start = time.process_time()
        found.append(fit(motion.character.positions(motion.positions, motion.fps)))
        taken.append(time.process_time() - start)
    shown = "shown" if after.character.hinges else "not shown"
    steps = [largest_step(each.motion) for each in found]
    print(f"{name}: axis of the elbow {shown}; left to the positions at most "
          f"{1e3 * found[0].worst:.4f} and {1e3 * found[1].worst:.4f} mm; largest step "
          f"{steps[0]:.1f} and {steps[1]:.1f} degrees, the file's {largest_step(after):.1f}; "
          f"{len(after.root) / taken[0]:.0f} and {len(after.root) / taken[1]:.0f} frames/s")  # fmt: skip
    for (part, first), (_, then) in zip(rows(before, found[0]), rows(after, found[1]), strict=True):
        print(f"    {part:10}" + "".join(f"{a:8.1f} -> {b:5.1f}" for a, b in zip(first, then, strict=True)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=Path, default=Path(os.environ.get("RETARGET_BENCH_DATA", ".")))
    parser.add_argument("--frames", type=int, default=600)
    options = parser.parse_args()
    print(f"    {'joint':10}{'world':>11}{'swing':>16}{'twist':>16}   degrees, before -> after")
    for name in RIGS:
        told(options.root, name, options.frames)


if __name__ == "__main__":
    main()
