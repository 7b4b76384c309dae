"""Files of predictions: ours, and those that anyone else has written."""

from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from retarget_bench.api import Prediction
from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import LARGEST, check_ordinary
from retarget_bench.motion import bvh
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.reading import UNITS
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
