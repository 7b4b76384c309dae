"""Files of predictions: ours, and those that anyone else has written."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from retarget_bench.api import Case, Prediction
from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import LARGEST, check_ordinary
from retarget_bench.motion import bvh, rotation, transfer
from retarget_bench.motion.character import Character, Motion, Positions
from retarget_bench.motion.files.reading import UNITS
from retarget_bench.motion.recording import MIRROR
from retarget_bench.motion.up_axis import UP_AXES
from retarget_bench.results.rows import read_npz, write_npz

_RATIOS = sorted({one / other for one in (*UNITS.values(), 0.3048) for other in (*UNITS.values(), 0.3048)})
"""Units in others, of which a file and the target's may be."""
_OFF = 1e-3
"""Share of its height, or of a unit, by which a body in a file may differ from the target by rounding."""


def write_prediction(path: Path, prediction: Prediction, key: str) -> None:
    """``.npz``: joints, fps, key, and rotations + root, positions or vertices in single precision."""
    common = {
        "joints": np.array(prediction.skeleton.names),
        "fps": np.float64(prediction.fps),
        "key": np.array(key),
    }
    data = {name: getattr(prediction, name).astype(np.float32) for name in prediction.arrays}
    write_npz(path, common | data)


def stored_key(path: Path) -> str | None:
    """The key that a prediction file was written under; None where it is missing or damaged."""
    try:
        check_ordinary(path)
        with path.open("rb") as opened, np.load(opened) as file:
            return str(file["key"])
    except (OSError, ValueError, KeyError, EOFError, BadZipFile, FileError):
        return None


def read_prediction(path: Path, target: Character, fps: float) -> Prediction:
    """A prediction of ``target`` from ``.npz`` (ours or anyone's) or ``.bvh``.

    A foreign ``.npz`` needs ``rotations`` ``(frames, joints, 4)`` and ``root`` ``(frames, 3)``, or
    ``positions`` ``(frames, joints, 3)``, or ``vertices`` of the target's mesh ``(frames, V, 3)``, in
    metres; ``joints`` (names, any order) and ``fps`` are taken into account where given. Raises FileError.
    """
    check_ordinary(path, LARGEST)
    if path.suffix.lower() == ".bvh":
        return _from_bvh(path, target)
    data = read_npz(path, "is not a readable .npz file", LARGEST)
    try:
        fps = float(data.get("fps", fps))
    except (TypeError, ValueError):
        raise FileError(path, f"fps is {data['fps']!r}; it must be one number") from None
    order = _joint_order(path, data.get("joints"), target)
    try:
        if "vertices" in data:
            return target.surface(data["vertices"], fps)
        if "positions" in data:
            return target.positions(data["positions"][:, order], fps)
        return target.motion(data["rotations"][:, order], data["root"], fps)
    except (KeyError, IndexError, TypeError, ValueError, BenchError) as error:
        raise FileError(path, f"does not hold a motion of {target.name!r}: {error}") from error


def _joint_order(path: Path, names: np.ndarray | None, target: Character) -> list[int] | slice:
    """The position of each joint of the target in the file."""
    if names is None:
        return slice(None)
    position = {str(name): index for index, name in enumerate(np.atleast_1d(names))}
    missing = [name for name in target.skeleton.names if name not in position]
    if missing:
        raise FileError(path, f"lacks the joints {', '.join(missing[:5])} of {target.name!r}")
    return [position[name] for name in target.skeleton.names]


def _from_bvh(path: Path, target: Character) -> Prediction:
    """A BVH file as a motion of ``target``; its unit is the one in which its bones fit the target's. Raises
    FileError where these fit in no unit."""
    recording = bvh.read(path)
    if target.skeleton.names[0] not in recording.skeleton.names:
        recording = bvh.read(path, fold=False)  # the target has a joint that only carries its hips
    order = _joint_order(path, np.array(recording.skeleton.names), target)
    bones = recording.skeleton.bone_lengths[order]
    scale = float(target.skeleton.bone_lengths.sum() / max(float(bones.sum()), 1e-12))
    placed = target.motion(recording.rotations[:, order], recording.root * scale, recording.fps)
    off = np.abs(recording.skeleton.offsets[order][1:] * scale - target.skeleton.offsets[1:])
    if off.max(initial=0.0) > _OFF * target.height:
        joint = target.skeleton.names[1 + int(off.max(axis=1).argmax())]
        raise FileError(path, f"has another body than {target.name!r}: the bone of {joint!r} differs")
    unit = min(_RATIOS, key=lambda ratio: abs(ratio / scale - 1))
    if abs(unit / scale - 1) > _OFF:
        size = f"that of {target.name!r} is {scale:.4g} times as large, and no unit is so large in another"
        raise FileError(path, f"has another body than its target: {size}")
    return placed


# ------------------------------------------------------------------------------- other conventions
_SAMPLE = 40
"""Frames by which conventions are told."""
_FAR, _NEAR, _NEARER = 0.04, 0.1, 0.5
"""Shares of the height: how far from its source's pose an answer is that is doubted, how near another
convention has to bring it, and to which share of the distance."""
_LARGE = 20.0
"""How many times as far from the origin as its source an answer is that is in a smaller unit."""
_SMALLER = {100.0: "centimetres", 1000.0: "millimetres", 1.0 / 0.0254: "inches"}


def doubt(prediction: Prediction, case: Case) -> str:
    """A sentence on an answer that fits its source far better if it was written under another convention
    than ours: metres, w first in quaternions, Y up, X to the left; "" for others.

    It is compared with the source's pose on the target, about the hips.
    """
    source, target = case.source, case.target
    if not isinstance(source, Motion) or not isinstance(prediction, Motion | Positions):
        return ""
    if transfer.reason(source.character, target) or prediction.frames != source.frames:
        return ""
    sample = np.unique(np.linspace(0, source.frames - 1, _SAMPLE).astype(int))
    answer, expected = prediction.at(sample), transfer.carry(source.at(sample), target, "height")
    signs = []
    if (ratio := _extent(answer) / max(_extent(expected), 1e-9)) > _LARGE:
        factor = min(_SMALLER, key=lambda each: abs(math.log(each / ratio)))
        signs.append(f"lengths in {_SMALLER[factor]}, not metres")
        if isinstance(answer, Positions):
            answer = replace(answer, positions=answer.positions / factor)
    off = _distance(answer, expected)
    if off > _FAR:
        signs += _convention(answer, expected, min(_NEAR, _NEARER * off))
    return f"the answers look as if they had {', '.join(signs)}" if signs else ""


def _extent(prediction: Motion | Positions) -> float:
    """How far the hips are from the origin."""
    return float(np.median(np.linalg.norm(transfer.hips(prediction), axis=-1)))


def _distance(answer: Motion | Positions, expected: Motion) -> float:
    """Share of the height that joints are apart, about the hips, on average."""
    hips = expected.character.joint_of["hips"]
    one, other = (each.positions - each.positions[:, hips, None] for each in (answer, expected))
    return float(np.linalg.norm(one - other, axis=-1).mean()) / expected.character.height


def _convention(answer: Motion | Positions, expected: Motion, within: float) -> tuple[str, ...]:
    """The fewest other conventions, at most two, under which an answer is so near; () where none is."""
    changes = _CHANGES if isinstance(answer, Motion) else _CHANGES_OF_POSITIONS
    for count in (1, 2):
        distances = {}
        for signs in combinations(changes, count):
            changed = answer
            for sign in signs:
                changed = changes[sign](changed)
            distances[signs] = _distance(changed, expected)
        best = min(distances, key=distances.__getitem__)
        if distances[best] < within:
            return best
    return ()


def _w_first(answer: Motion) -> Motion:
    return replace(answer, rotations=np.roll(answer.rotations, 1, axis=-1))


_Z_UP = rotation.from_rotation_vector(np.array(UP_AXES["z"]))


def _y_up(answer: Motion) -> Motion:
    turned = np.array(answer.rotations)
    turned[:, 0] = rotation.multiply(_Z_UP[None], turned[:, 0])
    return replace(answer, rotations=turned, root=rotation.rotate(_Z_UP[None], answer.root))


def _other_sides(character: Character) -> list[int]:
    """The joint of the other side for each joint, itself where there is none."""
    other = {"left": "right", "right": "left"}
    sides = [(role or "").partition("_") for role in character.roles]
    opposite = [f"{other.get(side, side)}_{part}" for side, _, part in sides]
    return [character.joint_of.get(role, joint) for joint, role in enumerate(opposite)]


_SIDES = "left and right exchanged"
_CHANGES: Mapping[str, Callable[[Any], Motion | Positions]] = {
    "quaternions x, y, z, w, not w, x, y, z": _w_first,
    "Z up, not Y": _y_up,
    _SIDES: lambda answer: replace(answer, rotations=answer.rotations[:, _other_sides(answer.character)]),
    "X to the right, not to the left": lambda answer: replace(
        answer, rotations=rotation.mirrored(answer.rotations), root=answer.root * MIRROR
    ),
}
"""Signs of another convention -> the answer as it would be written here."""
_CHANGES_OF_POSITIONS: Mapping[str, Callable[[Any], Motion | Positions]] = {
    "Z up, not Y": lambda answer: replace(answer, positions=rotation.rotate(_Z_UP, answer.positions)),
    _SIDES: lambda answer: replace(answer, positions=answer.positions[:, _other_sides(answer.character)]),
    "X to the right, not to the left": lambda answer: replace(answer, positions=answer.positions * MIRROR),
}
