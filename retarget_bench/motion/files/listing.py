"""The motion files of a folder, with a name for every motion in them."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path

import numpy as np

from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import composed
from retarget_bench.motion import bvh
from retarget_bench.motion.bvh.document import Hierarchy
from retarget_bench.motion.files import format_of, read, split_take, suffixes, takes
from retarget_bench.motion.files.formats import BVH, FORMATS
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.recording import Recording, reach

_DIGITS = 4


def motion_files(folder: Path) -> dict[str, Path]:
    """The motions in a folder itself, by name, sorted, without hidden files.

    A file has its name without the ending, or all of it where another file has that. Of a file with
    several takes each has a name of its own, and a path with ``#`` (``motion.files.split_take``).
    Raises FileError where the folder cannot be listed.
    """
    try:
        listed = sorted(each for each in folder.iterdir() if not each.name.startswith("."))
    except OSError as error:
        raise FileError(folder, f"cannot be listed ({error.strerror or error})") from error
    motions: dict[str, Path] = {}
    alone = {path.suffix.lower() for path in listed}
    for form in FORMATS:
        if alone & {*form.suffixes} - {*form.bodies}:  # beside motions, bodies are no clips
            listed = [path for path in listed if path.suffix.lower() not in form.bodies]
    for path in listed:
        if path.suffix.lower() in suffixes() and path.is_file():
            stem, complete = composed(path.stem), composed(path.name)
            for name, one in motions_of(path).items():
                motions[name if name not in motions else complete + name.removeprefix(stem)] = one
    return dict(sorted(motions.items()))


def motions_of(path: Path) -> dict[str, Path]:
    """The motions of a file by composed names: ``{"walk": walk.bvh}``, ``{"Fox-Walk": Fox.glb#2, ...}``."""
    stem = composed(path.stem)
    names: tuple[str, ...] = ()
    with suppress(BenchError):  # whoever reads it says why it cannot be read
        names = takes(path)
    if len(names) < 2:
        return {stem: path}
    motions: dict[str, Path] = {}
    for number, name in enumerate(names, 1):
        plain = composed(name).replace("/", "_").strip() or str(number)
        free = plain if f"{stem}-{plain}" not in motions else f"{plain}-{number}"
        motions[f"{stem}-{free}"] = path.with_name(f"{path.name}#{number}")
    return motions


def hierarchy_of(path: Path) -> Hierarchy:
    """The joints of a file: names, parents and offsets. Raises FileError."""
    if format_of(path) is BVH:
        return bvh.parse_header(path).hierarchy
    recording = read(path)
    skeleton = recording.skeleton
    channels: tuple[tuple[str, ...], ...] = ((),) * len(skeleton)
    return Hierarchy(skeleton.names, skeleton.parents, _bones(recording), channels, skeleton.end_sites)


def _bones(recording: Recording) -> np.ndarray:
    """``(joints, 3)`` what tells bodies apart: offsets; of joint positions lengths alone, since each clip
    shows how bones lie to each other a little differently."""
    skeleton = recording.skeleton
    if recording.positions is None:
        return skeleton.offsets
    return skeleton.bone_lengths[:, None] * np.array([1.0, 0.0, 0.0])


def facts(path: Path, rate: float | None = None) -> tuple[str, str, int, float]:
    """Of a file that is no BVH: hashes of its bytes and motion, and of its skeleton; frames; their rate.

    rate: that of a file that states none, or one that is none.
    Raises FileError, or NotSupported where the take in the path is not there.
    """
    own, take = split_take(path)
    recording = read(path, Reading(rate=rate))
    content = hashlib.sha256(own.read_bytes() + repr(take).encode())
    values = recording.rotations if recording.positions is None else recording.positions
    for array in (values, recording.root, recording.skeleton.offsets):
        content.update(np.ascontiguousarray(array).tobytes())  # of the files that it refers to
    skeleton = recording.skeleton
    bones = np.round(_bones(recording)[1:] / max(reach(skeleton), 1e-9), _DIGITS) + 0.0
    text = repr((skeleton.names, skeleton.parents.tolist(), bones.tolist()))
    hierarchy = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]
    return content.hexdigest(), hierarchy, len(recording.root), recording.fps
