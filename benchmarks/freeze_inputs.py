"""Freezes the inputs of ``bench check`` that are no motions: BVH text and its meaning, results of a table.

    python benchmarks/freeze_inputs.py

What the text means is computed by scipy. Golden rows are accepted apart, by ``bench check --accept``.
"""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from retarget_bench.api import INTRA, SELF, TWO_LEGS, CaseInfo, Direction
from retarget_bench.evaluation import set_metrics
from retarget_bench.evaluation.set_metrics import SetValue
from retarget_bench.files import write_csv, write_text
from retarget_bench.results import store
from retarget_bench.results.header import Counts, DatasetInfo, DeclaredValue, MethodInfo, ResultHeader
from retarget_bench.results.store import CaseResult, ResultPaths
from retarget_bench.verification.gate import core, golden

FRAMES, CLIPS, LOW_FRAMES = 3, 20, 12
Joint = tuple[str, str]
"""Name and channels: of rotations X, Y, Z, of positions x, y, z."""
FILES: dict[str, tuple[str, str, Sequence[Joint]]] = {
    "orders.bvh": (
        "0.0083333", "\n",
        [("Hips", "xyzZXY"), *((order, order) for order in map("".join, permutations("XYZ")))],
    ),
    "mixed.bvh": (
        "0.041667", "\r\n",
        [("Hips", "ZyXxYz"), ("two", "YX"), ("one", "Z"), ("none", ""), ("placed", "xzyYZX")],
    ),
}  # fmt: skip
METHODS = {"best": 0.0, "near": 0.22, "far": 0.3, "fewer": 0.2, "control": -0.5}
"""How much larger its errors are; ``near`` has an adjusted p-value of 7 %."""


def hierarchy(joints: Sequence[Joint], depth: int = 0) -> Iterator[str]:
    """The joints, each below the one before."""
    (name, channels), below = joints[0], joints[1:]
    names = " ".join(f"{c.upper()}{'rotation' if c.isupper() else 'position'}" for c in channels)
    yield f"{'JOINT' if depth else 'ROOT'} {name}"
    yield from ("{", f"OFFSET {depth} {9 + depth} 0.5", f"CHANNELS {len(channels)} {names}".rstrip())
    yield from hierarchy(below, depth + 1) if below else ("End Site", "{", "OFFSET 0 1 0", "}")
    yield "}"


def bvh(seconds: str, end: str, joints: Sequence[Joint], random: np.random.Generator) -> tuple[str, list]:
    """The text, and ``frame, joint, w, x, y, z`` of what it means."""
    frames, meant = [], []
    for frame in range(FRAMES):
        told: list[str] = []
        for joint, (_, channels) in enumerate(joints):
            # a bone may not change its length: places below the root stay
            numbers = [random.uniform(-170, 170) if c.isupper() or not joint else 4.5 for c in channels]
            text = [f"{number:.5f}" for number in numbers]
            turns = [float(t) for c, t in zip(channels, text, strict=True) if c.isupper()]
            order = "".join(filter(str.isupper, channels))
            turned = Rotation.from_euler(order, turns, degrees=True) if turns else Rotation.identity()
            x, y, z, w = np.asarray(turned.as_quat()).ravel()
            meant.append([frame, joint, *(f"{each:.15g}" for each in (w, x, y, z))])
            told += text
        frames.append(" ".join(told))
    lines = [
        "HIERARCHY",
        *hierarchy(joints),
        "MOTION",
        f"Frames: {FRAMES}",
        f"Frame Time: {seconds}",
        *frames,
    ]
    return end.join([*lines, ""]), meant


LIMBS = {
    "Spine": ((0, 12, 0), ["Chest"]),
    "Chest": ((0, 24, -1), ["Neck", "RightArm", "LeftArm"]),
    "Neck": ((0, 14, 1), ["Head"]),
    "Head": ((0, 9, 1), (0, 21, 0)),
    "RightUpLeg": ((-9, -4, 0), ["RightLeg"]),
    "RightLeg": ((-1, -41, 1), ["RightFoot"]),
    "RightFoot": ((0, -43, -2), ["RightToe"]),
    "RightToe": ((-1, -7, 13), (0, 0, 6)),
    "RightArm": ((-17, 8, 0), ["RightForeArm"]),
    "RightForeArm": ((-19, -20, 1), ["RightHand"]),
    "RightHand": ((-17, -18, 2), (-11, -12, 0)),
}
"""Joint -> its offset in centimetres, and its children or the offset of its tip: a body in A-pose."""


def mirrored(offset: tuple[float, float, float]) -> tuple[float, float, float]:
    return -offset[0], *offset[1:]


def low_hips(random: np.random.Generator) -> str:
    """A body whose hips lie below two other joints, the joints in another order than usual."""
    body = LIMBS | {
        f"Left{name[5:]}": (
            mirrored(offset),
            mirrored(below)
            if isinstance(below, tuple)
            else [each.replace("Right", "Left") for each in below],
        )
        for name, (offset, below) in LIMBS.items()
        if name.startswith("Right")
    }
    body |= {
        "Ground": ((0, 0, 0), ["Carrier"]),
        "Carrier": ((0, 38, 4), ["Hips"]),
        "Hips": ((0, 60, -4), ["Spine", "RightUpLeg", "LeftUpLeg"]),
    }
    lines, joints = [], list[str]()

    def joint(name: str, depth: int) -> None:
        (offset, below), pad = body[name], "\t" * depth
        joints.append(name)
        places = "" if depth else "Xposition Yposition Zposition "
        lines.extend([
            f"{pad}{'JOINT' if depth else 'ROOT'} {name}",
            f"{pad}{{",
            f"{pad}\tOFFSET {' '.join(map(str, offset))}",
            f"{pad}\tCHANNELS {3 if depth else 6} {places}Zrotation Xrotation Yrotation",
        ])  # fmt: skip
        if isinstance(below, tuple):
            lines.append(f"{pad}\tEnd Site {{ OFFSET {' '.join(map(str, below))} }}")
        else:
            for each in below:
                joint(each, depth + 1)
        lines.append(f"{pad}}}")

    joint("Ground", 0)
    frames = []
    for frame in range(LOW_FRAMES):
        angles = random.normal(0, 9, size=3 * len(joints))
        numbers = [3.0 * frame, 0.5, 2.0 * frame, *angles]
        frames.append(" ".join(f"{each:.4f}" for each in numbers))
    tail = ["MOTION", f"Frames: {LOW_FRAMES}", "Frame Time: 0.0333333", *frames]
    return "\n".join(["HIERARCHY", *lines, *tail, ""])


SIDES: Mapping[str, Direction] = {"error": "lower", "ratio": "target", "share": "higher", "pooled": "lower"}
SETS = {"best": (2.0, 0.05), "near": (2.1, 0.2), "far": (9.0, 0.1)}
"""Method -> its distance as a set, and how far it moves without a tenth of the clips; the references score
``FLOOR``."""
FLOOR = 1.25


def declared(key: str, better: Direction) -> DeclaredValue:
    return DeclaredValue(
        label=key, meaning="", unit="1", better=better, goal=1.0, tolerance=1e-6, index="",
        with_self=key == "pooled",
    )  # fmt: skip


Row = tuple[str, str, float, float]
"""Clip, pair of bodies, error and ratio; nan where the case was not answered."""


def rows(random: np.random.Generator) -> dict[str, list[Row]]:
    """Method -> its rows: two pairs of most clips, one or three of some."""
    clips = [(clip, pair) for clip in range(CLIPS) for pair in range({3: 1, 7: 3}.get(clip, 2))]
    hard = {clip: random.gamma(2.0) + 1.0 for clip in range(CLIPS)}
    found = {}
    for method, worse in METHODS.items():
        of_clip = {clip: worse + 0.25 * random.standard_normal() for clip in range(CLIPS)}
        found[method] = list[Row]()
        for number, (clip, pair) in enumerate(clips):
            error = hard[clip] + of_clip[clip] + 0.1 * random.standard_normal()
            ratio = np.exp(0.4 * (of_clip[clip] + 0.2 * random.standard_normal()))
            answered = method != "fewer" or number % 13  # 37 of 40
            numbers = [float(f"{each:.6g}") if answered else np.nan for each in (error, ratio)]
            found[method].append((f"clip-{clip:02d}", f"a{pair}>b", *numbers))
    return found


def write_results(root: Path, method: str, split: str, listed: Sequence[Row]) -> None:
    """The result files of a method; on self pairs of every fourth clip, where it errs by one more."""
    infos, entries = [], []
    for clip, pair, error, ratio in listed[:: 8 if split == SELF else 1]:
        source, target = pair.split(">")
        source = target if split == SELF else source
        case = f"frozen/{source}>{target}/{clip}"
        infos.append(CaseInfo(case, "retarget", split, source, target, clip, "", 10))
        error += split == SELF
        answered = not np.isnan(error)
        values = {"error": error, "ratio": ratio, "share": float(np.exp(-error)), "pooled": error}
        entries.append(CaseResult(case, "ok" if answered else "failed", values=values if answered else {}))
    header = ResultHeader(
        keys={},
        split=split,
        method=MethodInfo(label=method, privileged=(), control=method == "control"),
        dataset=DatasetInfo(label="frozen", content="frozen", notes=()),
        metrics={},
        values={key: declared(key, better) for key, better in SIDES.items()},
        set_values={core.DISTANCE: declared(core.DISTANCE, "lower")},
        counts=Counts.of(entry.status for entry in entries),
        problems=(),
    )
    paths = ResultPaths(root, "frozen", "retarget", split, method)
    if split == INTRA and method in SETS:
        distance, spread = SETS[method]
        facts = (distance, distance - 3 * spread, distance + 3 * spread, FLOOR)
        without = tuple((distance + spread * np.cos(np.arange(10))).tolist())
        value = SetValue(core.DISTANCE, TWO_LEGS, 100, 20, *facts, "real", without=without)
        set_metrics.write(paths, [value])
    store.write_results(paths, header, entries, infos)


README = """# Frozen inputs

Written by `benchmarks/freeze_inputs.py`; not edited by hand. All numbers are drawn at random (CC0 1.0).

- `orders.bvh`: a joint with each of the six orders of rotation channels, at 120 frames per second.
- `mixed.bvh`: positions and rotations of the root by turns, joints with two, one and no channel, and one
  with constant positions; lines end in CR LF; 24 frames per second.
- `low_hips.bvh`: a body in A-pose whose hips lie below two other joints; its tips are End Sites.
- `rotations.csv`: the rotations that these files mean, by `scipy.spatial.transform.Rotation.from_euler`.
- `table`: results of five made-up methods on 40 cases of 20 clips, and on self pairs: one is close to the
  best, one far from it, one answered 37 cases, and one is a control.
"""


def main() -> None:
    folder = golden.built_in() / core.INPUTS
    random = np.random.Generator(np.random.Philox(7))
    meant = []
    for name, (seconds, end, joints) in FILES.items():
        text, rotations = bvh(seconds, end, joints, random)
        folder.mkdir(exist_ok=True)
        (folder / name).write_bytes(text.encode())
        meant += [[name, *row] for row in rotations]
    low = low_hips(np.random.Generator(np.random.Philox(8)))
    write_text(folder / core.LOW_HIPS, low)
    write_csv(folder / "rotations.csv", ["file", "frame", "joint", "w", "x", "y", "z"], meant)
    shutil.rmtree(folder / core.RESULTS, ignore_errors=True)
    for method, listed in rows(random).items():
        for split in (SELF, INTRA):
            write_results(folder / core.RESULTS, method, split, listed)
    write_text(folder / "README.md", README)


if __name__ == "__main__":
    main()
