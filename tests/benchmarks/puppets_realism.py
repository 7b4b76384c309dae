"""Puppets beside recorded motion: ranges of angles, speeds, foot heights, pelvis and jerk.

    python tests/benchmarks/puppets_realism.py PATH/TO/data [--plots DIR]

in an environment in which retarget-bench and, for the plots, matplotlib are installed. ``data`` has folders
``bandai_namco``, ``lafan1``, ``mixamo_san`` and ``dog`` of BVH files; those that are absent are left out.

For every group of performances (walks, runs, gestures; dogs walking and running) each feature is a set of
numbers, one a frame and side, at 30 frames per second. ``mixed takes`` are those of lafan1, in which people
also climb over things, push each other and dance. Printed: its 5th, 50th and 95th percentile, recorded
and made, and the overlap: how much of the two histograms covers each other, from 0 to 1, in 40 bins over
both. Lengths are in leg lengths. Frames of long takes are counted to a group by the speed of the pelvis,
given below. What is compared are marginal statistics: nobody can tell from them whether motion looks alive.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from retarget_bench.datasets.puppets.bodies import rigs
from retarget_bench.datasets.puppets.corpus.families import families
from retarget_bench.datasets.puppets.randomness import Stream
from retarget_bench.motion.importer import load
from retarget_bench.motion.motion import Motion

FPS = 30.0
WALKING, RUNNING = (0.6, 2.2), (2.4, 9.0)
"""Leg lengths a second that the pelvis travels, smoothed over a second."""
UPRIGHT = {"walk": 30.0, "walk in mixed takes": 30.0, "run": 45.0, "run in mixed takes": 45.0}
"""Degrees that the trunk may lean in people's locomotion, so that crawling over obstacles is no walk; and
the hips are at least three quarters of a leg high."""
PEOPLE = ("ada", "boris", "clara", "emil", "igor", "jonas", "quinn", "hanna")
"""Puppets of usual build; recorded people are grown up."""

RECORDED = {
    "walk": ("bandai_namco/*walk_*.bvh", "mixamo_san/Aj/*Walk*.bvh"),
    "walk in mixed takes": ("lafan1/*_subject*.bvh",),
    "run": (
        "bandai_namco/*run_*.bvh",
        "bandai_namco/*dash_*.bvh",
        "mixamo_san/Aj/Run*.bvh",
    ),
    "run in mixed takes": ("lafan1/*_subject*.bvh",),
    "gesture": (
        "bandai_namco/*bow*.bvh",
        "bandai_namco/*bye*.bvh",
        "bandai_namco/*guide*.bvh",
        "mixamo_san/Aj/*Gesture.bvh",
        "mixamo_san/Aj/* Standing Pose.bvh",
        "mixamo_san/Aj/*Signaling.bvh",
    ),
    "dog walk": ("dog/D1*.bvh",),
    "dog run": ("dog/D1*.bvh",),
}
MADE = {
    "walk": (("walk", "arc"), WALKING),
    "walk in mixed takes": (
        ("walk", "arc", "turn", "walk_backwards", "walk_sideways"),
        WALKING,
    ),
    "run": (("jog", "run"), RUNNING),
    "run in mixed takes": (("jog", "run", "leap", "hop"), RUNNING),
    "gesture": (("wave", "point", "bow", "salute", "clap", "stand"), (0.0, 0.8)),
    "dog walk": (("dog_walk",), (0.6, 2.2)),
    "dog run": (("trot", "gallop"), (2.6, 12.0)),
}
CLIPS = 20
"""Of each kind, each by a quarter of the puppets of its group."""
Features = dict[str, list[np.ndarray]]


# ----------------------------------------------------------------------------------------- features
def features(motion: Motion, group: str) -> dict[str, np.ndarray]:
    """Feature -> one number a frame, that belongs to the group."""
    places, joint = motion.positions, motion.character.joint_of
    leg = leg_length(motion)

    def at(role: str) -> np.ndarray:
        return places[:, joint[role]]

    pelvis = smoothed(at("hips"), 31)
    speed = np.linalg.norm(np.gradient(pelvis[:, [0, 2]], axis=0), axis=-1) * FPS / leg
    found = {"speed, legs/s": speed}
    across = at("left_up_leg") - at("right_up_leg")
    across[:, 1] = 0.0
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-9)
    ahead = np.cross(across, [0.0, 1.0, 0.0])
    height = at("hips")[:, 1] / leg
    found["pelvis up and down, % of leg"] = 100.0 * (height - smoothed(height[:, None], 31)[:, 0])
    lean = found["trunk lean, deg"] = pitch(at("neck") - at("hips"), ahead)
    slowest, fastest = MADE[group][1]
    chosen = (speed >= slowest) & (speed <= fastest) & (np.abs(lean) <= UPRIGHT.get(group, 180.0))
    chosen &= (
        height - np.percentile(at("left_toe" if "left_toe" in joint else "left_foot")[:, 1], 2) / leg > 0.75
    )
    chosen[:4] = chosen[-4:] = False
    for side in ("left", "right"):
        knee = bend(at(f"{side}_up_leg"), at(f"{side}_leg"), at(f"{side}_foot"))
        elbow = bend(at(f"{side}_arm"), at(f"{side}_forearm"), at(f"{side}_hand"))
        foot, hand = at(f"{side}_foot"), at(f"{side}_hand")
        thigh = pitch(at(f"{side}_up_leg") - at(f"{side}_leg"), -ahead)
        arm = pitch(at(f"{side}_arm") - at(f"{side}_forearm"), -ahead)
        mine = {
            "knee bend, deg": knee,
            "elbow bend, deg": elbow,
            "thigh forward, deg": thigh,
            "upper arm forward, deg": arm,
            "upper arm out, deg": pitch(
                at(f"{side}_arm") - at(f"{side}_forearm"), across * (-1.0 if side == "left" else 1.0)
            ),
            "knee speed, deg/s": np.gradient(knee) * FPS,
            "elbow speed, deg/s": np.gradient(elbow) * FPS,
            "ankle height, % of leg": 100.0 * (foot[:, 1] - lowest(foot[chosen, 1])) / leg,
            "hand speed, legs/s": np.linalg.norm(np.gradient(hand, axis=0), axis=-1) * FPS / leg,
            "foot jerk, legs/s3": jerk(foot, leg),
            "hand jerk, legs/s3": jerk(hand, leg),
        }
        for name, values in mine.items():
            found[name] = np.concatenate([found[name], values]) if name in found else values
    found["pelvis jerk, legs/s3"] = jerk(at("hips"), leg)
    if group.startswith("dog"):
        found.pop("upper arm out, deg")
    return {name: values[np.tile(chosen, len(values) // len(chosen))] for name, values in found.items()}


def lowest(heights: np.ndarray) -> float:
    return float(np.percentile(heights, 2)) if len(heights) else 0.0


def leg_length(motion: Motion) -> float:
    joint = motion.character.joint_of
    bones = [motion.skeleton.bone_lengths[joint[f"left_{part}"]] for part in ("leg", "foot")]
    return float(sum(bones))


def smoothed(path: np.ndarray, width: int) -> np.ndarray:
    """``(frames, n)`` under a moving average, ends repeated."""
    padded = np.pad(path, ((width // 2, width // 2), (0, 0)), mode="edge")
    sums = np.cumsum(np.concatenate([np.zeros((1, path.shape[1])), padded]), axis=0)
    return (sums[width:] - sums[:-width]) / width


def pitch(line: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Degrees by which an upward line leans ahead."""
    return np.degrees(np.arctan2((line * ahead).sum(axis=-1), line[:, 1]))


def bend(top: np.ndarray, middle: np.ndarray, end: np.ndarray) -> np.ndarray:
    upper, lower = middle - top, end - middle
    across = np.linalg.norm(np.cross(upper, lower), axis=-1)
    return np.degrees(np.arctan2(across, (upper * lower).sum(axis=-1)))


def jerk(path: np.ndarray, leg: float) -> np.ndarray:
    third = np.diff(path, 3, axis=0, prepend=path[:1], append=path[-1:].repeat(2, 0))
    return np.linalg.norm(third, axis=-1) * FPS**3 / leg


# ------------------------------------------------------------------------------------------ motions
def recorded(data: Path, group: str) -> Iterator[Motion]:
    for pattern in RECORDED[group]:
        for path in sorted(data.glob(pattern)):
            yield load(path, fps=FPS).motion


def made(group: str) -> Iterator[Motion]:
    kinds, _ = MADE[group]
    for family in families():
        names = PEOPLE if family.name == "people" else tuple(family.bodies)
        for kind in (kind for kind in kinds if kind in family.kinds):
            for number in range(CLIPS):
                score = family.kinds[kind](Stream("puppets", "realism", f"{kind}-{number}"), 180)
                for name in names[number % 4 :: 4]:
                    body = family.bodies[name]
                    solution, who = family.solve(score, body), rigs.character(body)
                    local = rigs.rotations(solution.orientations, body, who)
                    yield who.motion(local, solution.root, FPS)


def gathered(motions: Iterator[Motion], group: str) -> dict[str, np.ndarray]:
    found: Features = {}
    for motion in motions:
        if motion.frames > 20:
            for name, values in features(motion, group).items():
                found.setdefault(name, []).append(values)
    return {name: np.concatenate(values) for name, values in found.items()}


# ----------------------------------------------------------------------------------------- comparing
def overlap(a: np.ndarray, b: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Share of two histograms that cover each other; edges and both histograms."""
    ends = np.percentile(a, (1, 99)), np.percentile(b, (1, 99))
    low, high = min(pair[0] for pair in ends), max(pair[1] for pair in ends)
    edges = np.linspace(low, high, 41)
    one, two = (np.histogram(np.clip(x, low, high), edges)[0] / len(x) for x in (a, b))
    return float(np.minimum(one, two).sum()), edges, one, two


def table(group: str, real: dict[str, np.ndarray], ours: dict[str, np.ndarray]) -> None:
    print(f"\n### {group}\n")
    frames = [len(each["speed, legs/s"]) / FPS for each in (real, ours)]
    print(f"{frames[0]:.0f} s recorded, {frames[1]:.0f} s made.\n")
    print("| feature | recorded 5 / 50 / 95 % | puppets 5 / 50 / 95 % | overlap |\n|---|---|---|---|")
    for name in real:
        rows = [
            " / ".join(f"{v if abs(v) > 1e-3 else 0:.3g}" for v in np.percentile(x[name], (5, 50, 95)))
            for x in (real, ours)
        ]
        print(f"| {name} | {rows[0]} | {rows[1]} | {overlap(real[name], ours[name])[0]:.2f} |")


def plot(group: str, real: dict[str, np.ndarray], ours: dict[str, np.ndarray], folder: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    rows = -(-len(real) // 5)
    figure, axes = plt.subplots(rows, 5, figsize=(13, 1.9 * rows))
    for axis in axes.ravel()[len(real) :]:
        axis.axis("off")
    for axis, name in zip(axes.ravel(), real, strict=False):
        share, edges, one, two = overlap(real[name], ours[name])
        axis.stairs(one, edges, fill=True, color="0.75", label="recorded")
        axis.stairs(two, edges, color="tab:blue", label="puppets")
        axis.set_title(f"{name}: {share:.2f}", fontsize=8)
        axis.tick_params(labelsize=6, left=False, labelleft=False)
    axes.ravel()[0].legend(fontsize=6)
    figure.tight_layout(pad=0.4)
    place = folder / f"realism-{group.replace(' ', '-')}.png"
    figure.savefig(place, dpi=65)
    plt.close(figure)
    from PIL import Image

    Image.open(place).convert("RGB").quantize(16).save(place, optimize=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--plots", type=Path)
    options = parser.parse_args()
    for group in RECORDED:
        real = gathered(recorded(options.data, group), group)
        ours = gathered(made(group), group)
        if not real or not ours:
            print(f"\n### {group}\n\nnothing to compare.")
            continue
        table(group, real, ours)
        if options.plots:
            options.plots.mkdir(parents=True, exist_ok=True)
            plot(group, real, ours, options.plots)


if __name__ == "__main__":
    main()
