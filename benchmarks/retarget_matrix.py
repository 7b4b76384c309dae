"""``bench retarget`` between files of all formats and origins: what comes out of every pair.

    python benchmarks/retarget_matrix.py PATH/TO/DATA [--method ik] [--frames 240] [--sheets DIR]

Every source below is carried to every target on as many legs, written in the format of the target's file,
and read again. A pair is right where

- joints: the file has the target's joints, and every number is finite;
- floor: no foot, hand or head goes more than 2 % of the height deeper below the floor than the source does;
- speed: no joint turns more than 1.5 times faster than its counterpart ever does (``joint_speed_excess``);
- limbs: upper arms and forearms point within 3 degrees of where copied rotations have them, in nine frames
  of ten of those in which the source's hand is away from its body and the floor, for there copying is
  right (elsewhere hands are held, and legs always carry feet, which copying does not);
- sides: the left hip and shoulder are to the left, as the source's are.

Prints a section of ``results/measurements.md``. --sheets: a folder for a contact sheet of every source,
which holds motion of others and stays out of the repository.
"""

from __future__ import annotations

import argparse
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import retarget_bench as rb
from retarget_bench.api import Case, CaseInfo
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import BenchError
from retarget_bench.metrics.joint_speed import plugin as JointSpeed
from retarget_bench.motion import files
from retarget_bench.motion.character import Motion
from retarget_bench.python.progress import progress_bar
from retarget_bench.viewer import clips, drawing, scene_builder

SOURCES = {
    "Mixamo, Aj": "mixamo_san/Aj/Running.bvh",
    "Mixamo, Goblin": "mixamo_san/Goblin_m/Combo Punch.bvh",
    "Mixamo, Ortiz, fingers": "mixamo_r2et/Ortiz/Angry.bvh",
    "LAFAN1": "lafan1/dance1_subject1.bvh",
    "CMU, AMC": "cmu_asfamc/02_01.amc",
    "CMU, iClone": "cmu_iclone/002_03.bvh",
    "CMU, cgspeed": "cmu_train/05_01.bvh",
    "Bandai Namco": "bandai_namco/dataset-1_bow_normal_001.bvh",
    "SAME, rope": "same_pairs/SFU/0005_JumpRope001_0.bvh",
    "GLB, Soldier": "gltf/Soldier.glb#Walk",
    "MANN, dog": "dog/D1_009_KAN01_001.bvh",
    "GLB, Fox": "gltf/Fox.glb#Walk",
}
TARGETS = {
    "Mixamo, Kaya": "mixamo_san/Kaya/Running.bvh",
    "Mixamo, Mousey": "mixamo_san/Mousey_m/Running.bvh",
    "Mixamo, Mousey, fingers": "mixamo_r2et/Mousey/Angry.bvh",
    "LAFAN1": "lafan1/push1_subject2.bvh",
    "CMU, ASF": "cmu_asfamc/02.asf",
    "CMU, iClone": "cmu_iclone/002_01.bvh",
    "CMU, 131": "cmu_bvh/131_03.bvh",
    "Bandai Namco": "bandai_namco/dataset-1_bye_normal_001.bvh",
    "SAME": "same_pairs/result/3.bvh",
    "GLB, Xbot": "gltf/Xbot.glb",
    "GLB, Soldier": "gltf/Soldier.glb",
    "MANN, dog": "dog/D1_ex01_KAN01_001.bvh",
    "GLB, Fox": "gltf/Fox.glb",
}
DEEP, FAST, APART, SHARE = 2.0, 1.5, 3.0, 0.9
"""Percent of height, ratio, degrees, and the share of frames that the last bar holds for."""
NEAR = 0.2
"""Of the height: hands that are nearer than this to something may be held."""
BODY = {
    "hips",
    "neck",
    "head",
    *(
        f"{side}_{part}"
        for side in ("left", "right")
        for part in ("arm", "forearm", "hand", "up_leg", "leg", "foot")
    ),
}
ACROSS = (("left_up_leg", "right_up_leg"), ("left_arm", "right_arm"))
LOW = ("left_foot", "right_foot", "left_toe", "right_toe", "left_hand", "right_hand", "head")


@dataclass(frozen=True)
class Found:
    """The measurements of a pair. faults: the names of the bars that it misses, with numbers."""

    faults: tuple[str, ...]
    deeper: float = 0.0
    faster: float = 1.0
    apart: float = 0.0


def loaded(path: Path, frames: int) -> rb.Motion:
    """A file's motion, its first frames at 30 per second."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        motion = rb.load_motion(path)
    if motion.fps != 30.0:
        motion = motion.resample(30.0)
    return motion.at(slice(0, frames))


def depth(motion: Motion) -> float:
    """The greatest depth of a foot, hand or head below y = 0, in % of height."""
    low = motion.character.joints(LOW)
    return float(100 * max(-motion.positions[:, low, 1].min(), 0.0) / motion.character.height)


def directions(motion: Motion, bones: list[tuple[str, str]]) -> np.ndarray:
    """``(frames, bones, 3)`` unit vectors."""
    joint = motion.character.joint_of
    ends = [(joint[upper], joint[lower]) for upper, lower in bones]
    along = np.stack([motion.positions[:, b] - motion.positions[:, a] for a, b in ends], axis=1)
    return along / np.linalg.norm(along, axis=-1, keepdims=True)


def away(source: Motion, side: str) -> np.ndarray:
    """``(frames,)``: whether a hand is further than ``NEAR`` from the floor and the body, its arm aside."""
    joint = source.character.joint_of
    arm = [f"{side}_{part}" for part in ("shoulder", "arm", "forearm", "hand")]
    others = [at for role, at in joint.items() if role not in arm and not role.startswith(f"{side}_hand")]
    others = [at for at in others if source.character.roles[at] in BODY]
    hand = source.positions[:, joint[f"{side}_hand"]]
    nearest = np.linalg.norm(source.positions[:, others] - hand[:, None], axis=-1).min(axis=1)
    return np.minimum(nearest, hand[:, 1]) > NEAR * source.character.height


def limbs_apart(answer: Motion, copied: Motion, source: Motion) -> float:
    """Degrees between free arms of two motions of one body, in the frame at ``SHARE`` of the worst."""
    worst = 0.0
    for side in ("left", "right"):
        bones = [(f"{side}_arm", f"{side}_forearm"), (f"{side}_forearm", f"{side}_hand")]
        roles = {role for bone in bones for role in bone}
        if not all(roles <= each.character.joint_of.keys() for each in (answer, source)):
            continue
        frames = away(source, side)
        if frames.any():
            cosines = (directions(answer, bones)[frames] * directions(copied, bones)[frames]).sum(axis=-1)
            angles = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))).max(axis=1)
            worst = max(worst, float(np.quantile(angles, SHARE)))
    return worst


def sides_kept(answer: Motion, source: Motion) -> bool:
    """Whether what is left of the source is left of the answer, nearly always."""
    for pair in ACROSS:
        if all(role in each.character.joint_of for role in pair for each in (answer, source)):
            one, other = (directions(each, [pair])[:, 0, [0, 2]] for each in (answer, source))
            if np.mean((one * other).sum(axis=-1) > 0.0) < SHARE:
                return False
    return True


def measured(
    source: rb.Motion, target: rb.Motion, method: str, folder: Path
) -> tuple[Found, Motion | None]:
    """Retarget a pair by way of a file, and look at what the file says."""
    body: rb.Character = target.character
    form = files.format_of(body.file.findings.path)
    out = folder / f"out{form.written[0] if form.written else '.glb'}"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rb.retarget(source, body, method).save(out)
            answer = rb.load_motion(out, roles=dict(zip(body.skeleton.names, body.roles, strict=True)))
            copied = rb.retarget(source, body, "copy_rotations")
    except BenchError as error:
        return Found((str(error),)), None
    if answer.skeleton.names != body.skeleton.names or not np.isfinite(answer.positions).all():
        return Found(("joints",)), answer
    info = CaseInfo("pair", "retarget", "cross", source.character.name, body.name, clip="pair")
    speeds = JointSpeed().compute(Comparison(Case(info, source, answer.character), answer))
    deeper = max(depth(answer) - depth(source), 0.0)
    faster, apart = speeds.get("joint_speed_excess", 1.0), limbs_apart(answer, copied, source)
    faults = [
        *([f"floor {deeper:.1f} %"] if deeper > DEEP else []),
        *([f"speed {faster:.2f}"] if faster > FAST else []),
        *([f"limbs {apart:.1f}°"] if apart > APART else []),
        *(["sides"] if not sides_kept(answer, source) else []),
    ]
    return Found(tuple(faults), deeper, faster, apart), answer


def pairs(sources: dict[str, rb.Motion], targets: dict[str, rb.Motion]) -> Iterator[tuple[str, str]]:
    """All that make sense: as many legs."""
    for source, motion in sources.items():
        for target, body in targets.items():
            if motion.character.four_legged == body.character.four_legged:
                yield source, target


def page(verdicts: dict[tuple[str, str], Found], method: str, frames: int) -> str:
    """The table: a row a source, a column a target."""
    right = sum(not each.faults for each in verdicts.values())
    names = list(dict.fromkeys(target for _, target in verdicts))
    lines = [
        "## Retargeting between files of all formats and origins",
        "",
        "    python benchmarks/retarget_matrix.py PATH/TO/DATA",
        "",
        f"`bench retarget -m {method}`, the first {frames} frames at 30 per second, by way of files in the "
        "target's format. Its script says what is checked: joints, floor (2 % of height), joint speed (1.5 "
        "times the source's), directions of free arms (3 degrees of copying), left and right. "
        f"**{right} of {len(verdicts)} pairs** miss none of these; cells name what a pair misses.",
        "",
        "| source | " + " | ".join(names) + " |",
        "|---|" + "---|" * len(names),
    ]
    for source in dict.fromkeys(source for source, _ in verdicts):
        cells = [
            ", ".join(each.faults) or "right" if (each := verdicts.get((source, target))) else ""
            for target in names
        ]
        lines.append(f"| {source} | " + " | ".join(cells) + " |")
    worst = {
        "deeper below the floor than the source, % of height": max(
            each.deeper for each in verdicts.values()
        ),
        "joint speed over the source's": max(each.faster for each in verdicts.values()),
        "arms off copied ones, degrees": max(each.apart for each in verdicts.values()),
    }
    lines += ["", "Worst of all pairs: " + "; ".join(f"{k} {v:.2f}" for k, v in worst.items()) + ".", ""]
    return "\n".join(lines)


def sheet(name: str, source: Motion, answers: dict[str, Motion], folder: Path) -> None:
    """Five moments of a source and all that came of it."""
    scene = scene_builder.of_motions([source, *answers.values()], [name, *answers])
    shown = drawing.moments(range(scene.frames), 5)
    style = drawing.DrawingStyle(size=(1500, 150 * (1 + len(answers))))
    folder.mkdir(parents=True, exist_ok=True)
    clips.write_still(folder / f"{name.replace(', ', '-')}.png", drawing.sheet(scene, style, shown))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--method", default="ik")
    parser.add_argument("--frames", type=int, default=240)
    parser.add_argument("--sheets", type=Path)
    options = parser.parse_args()
    sources = {name: loaded(options.data / file, options.frames) for name, file in SOURCES.items()}
    targets = {name: loaded(options.data / file, 1) for name, file in TARGETS.items()}
    verdicts: dict[tuple[str, str], Found] = {}
    answers: dict[tuple[str, str], Motion] = {}
    combinations = list(pairs(sources, targets))
    with tempfile.TemporaryDirectory() as folder, progress_bar("retargeting", "pairs", True) as progress:
        for number, (source, target) in enumerate(combinations, 1):
            verdicts[source, target], answer = measured(
                sources[source], targets[target], options.method, Path(folder)
            )
            if answer is not None and options.sheets:
                answers[source, target] = answer
            progress(number, len(combinations))
    print(page(verdicts, options.method, options.frames))
    for name, motion in sources.items() if options.sheets else ():
        sheet(name, motion, {k[1]: v for k, v in answers.items() if k[0] == name}, options.sheets)


if __name__ == "__main__":
    main()
