"""The table of file formats. A new one is a module here with a ``Format``, and its line in ``FORMATS``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion import bvh
from retarget_bench.motion.file_kinds import kind_of
from retarget_bench.motion.files.acclaim import reading as acclaim
from retarget_bench.motion.files.fbx import reading as fbx
from retarget_bench.motion.files.gltf import reading as gltf
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.files.smpl import amass, arrays
from retarget_bench.motion.recording import Recording


@dataclass(frozen=True)
class Format:
    """A kind of motion file.

    name:       for people.
    suffixes:   endings of file names, in small letters.
    kinds:      names of its kinds of files (``file_kinds``).
    read:       the motion; unit and up axis are said in the ``Recording`` only where the format or the
                file states them. Raises FileError for what cannot be read, NotSupported for what it cannot
                be told.
    takes:      the names of the motions in a file; () where a file holds one.
    written:    the endings under which results can be written; () where they cannot.
    beside:     other files that a file's motion depends on.
    bodies:     endings of files that hold a body in one pose; beside motions of the format they are no
                clips.
    """

    name: str
    suffixes: tuple[str, ...]
    kinds: tuple[str, ...]
    read: Callable[[Path, Reading], Recording]
    takes: Callable[[Path], tuple[str, ...]] = lambda path: ()  # noqa: ARG005
    written: tuple[str, ...] = ()
    bodies: tuple[str, ...] = ()
    beside: Callable[[Path], tuple[Path, ...]] = lambda path: ()  # noqa: ARG005


_UNTOLD = {
    "root_place": "root_place={value!r} is for BVH files; {path} states where its root is",
    "take": "{path} holds one motion of one body: leave out take={value!r}",
    "body": "{path} holds one motion of one body: leave out body={value!r}",
    "skeleton": "skeleton={value!r} is for AMC files; {path} holds its own bones",
    "body_model": "a body model is for AMASS files, and {path} is none: leave it out",
}
"""Options that most formats do not take -> the sentence about it."""


def _refuse(path: Path, reading: Reading, *names: str) -> None:
    """Raise NotSupported for an option in which the format leaves no choice."""
    for name in names:
        value = getattr(reading, name)
        if value is not None and not (name == "root_place" and value in ("auto", "absolute")):
            raise NotSupported(_UNTOLD[name].format(path=path, value=value))


def _read_bvh(path: Path, reading: Reading) -> Recording:
    _refuse(path, reading, "take", "body", "skeleton", "body_model")
    return bvh.read(path, root=reading.root_place, inner=True, rate=reading.rate)


def _read_gltf(path: Path, reading: Reading) -> Recording:
    _refuse(path, reading, "root_place", "skeleton", "body_model")
    return gltf.read(path, reading.take, reading.body)


def _read_fbx(path: Path, reading: Reading) -> Recording:
    _refuse(path, reading, "root_place", "skeleton", "body_model")
    return fbx.read(path, reading.take, reading.body)


def _read_acclaim(path: Path, reading: Reading) -> Recording:
    _refuse(path, reading, "take", "body", "root_place", "body_model")
    return acclaim.read(path, reading.skeleton)


def _read_amass(path: Path, reading: Reading) -> Recording:
    _refuse(path, reading, "take", "body", "root_place", "skeleton")
    return amass.read(path, reading.body_model, reading.rate)


def _read_joint_array(path: Path, reading: Reading) -> Recording:
    return of_array(path, arrays.read_array(path), reading)


def of_array(path: Path, array: np.ndarray, reading: Reading, joints: arrays.Joints = ()) -> Recording:
    """The motion of an array that a file holds, or that has none: see ``arrays.recorded``."""
    _refuse(path, reading, "take", "body", "root_place", "skeleton", "body_model")
    return arrays.recorded(path, array, reading.rate, joints)


def _refused(path: Path, reading: Reading | None = None) -> NoReturn:  # noqa: ARG001
    """Raise FileError that says why a path is not read."""
    kind_of(path)
    raise FileError(path, "was changed while it was read: read it again")


BVH = Format("BVH", (".bvh",), ("BVH",), _read_bvh, written=(".bvh",))
GLTF = Format("glTF", (".glb", ".gltf"), ("glTF",), _read_gltf, gltf.takes, written=(".glb",))
FBX = Format("FBX", (".fbx",), ("FBX",), _read_fbx, fbx.takes)
ACCLAIM = Format(
    "ASF/AMC",
    (".amc", ".asf"),
    ("AMC", "ASF"),
    _read_acclaim,
    bodies=(".asf",),
    beside=acclaim.needed,
)
AMASS = Format("AMASS", (".npz",), ("NPZ",), _read_amass, written=(".npz",))
JOINT_ARRAY = Format("joint array", (".npy",), ("NPY",), _read_joint_array)
FORMATS = (BVH, GLTF, FBX, ACCLAIM, AMASS, JOINT_ARRAY)
"""All formats, the first for files that nothing recognises."""
UNREADABLE = Format("no file", (), (), _refused, _refused)
"""Says why a path cannot be read: a folder, a device, a pointer, a web page, a file that is too large."""
