"""The table of file formats. A new one is a module here with a ``Format``, and its line in ``FORMATS``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from retarget_bench.errors import NotSupported
from retarget_bench.motion import bvh
from retarget_bench.motion.files.gltf import reading as gltf
from retarget_bench.motion.files.gltf.document import MAGIC
from retarget_bench.motion.files.smpl import amass, joint_arrays
from retarget_bench.motion.files.smpl.arrays import NPY, begins_as_archive
from retarget_bench.motion.recording import Recording


@dataclass(frozen=True)
class Reading:
    """What a reader may be told.

    root: how the root's place is stated (``bvh.read``), where the format leaves that open.
    take: which of several motions of a file, by name or number from 1 on.
    body: which of several bodies, likewise.
    rate: frames per second, told in place of what the file says: what it says may then be missing or wrong.
    body_model: file or folder of the body models that files of the SMPL family are of.
    """

    root: str = "auto"
    take: str | None = None
    body: str | None = None
    rate: float | None = None
    body_model: str | None = None


@dataclass(frozen=True)
class Format:
    """A kind of motion file.

    name:       for people.
    suffixes:   endings of file names, in small letters.
    recognises: whether a file is one, by its first bytes.
    read:       the motion; unit and up axis are said in the ``Recording`` only where the format prescribes
                them. Raises FileError for what cannot be read, NotSupported for what it cannot be told.
    takes:      the names of the motions in a file; () where a file holds one.
    written:    the endings under which results can be written; () where they cannot.
    """

    name: str
    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool]
    read: Callable[[Path, Reading], Recording]
    takes: Callable[[Path], tuple[str, ...]] = lambda path: ()  # noqa: ARG005
    written: tuple[str, ...] = ()


def _read_bvh(path: Path, reading: Reading) -> Recording:
    _one_motion(path, reading)
    _no_body_model(path, reading)
    return bvh.read(path, root=reading.root, inner=True)


def _read_gltf(path: Path, reading: Reading) -> Recording:
    _placed(path, reading, "glTF")
    _no_body_model(path, reading)
    return gltf.read(path, reading.take, reading.body)


def _read_amass(path: Path, reading: Reading) -> Recording:
    _one_motion(path, reading)
    _placed(path, reading, "AMASS")
    return amass.read(path, reading.body_model, reading.rate)


def _read_joint_array(path: Path, reading: Reading) -> Recording:
    _one_motion(path, reading)
    _placed(path, reading, "a joint array")
    _no_body_model(path, reading)
    return joint_arrays.read(path, reading.rate)


def _one_motion(path: Path, reading: Reading) -> None:
    for name, value in (("take", reading.take), ("body", reading.body)):
        if value is not None:
            raise NotSupported(f"{path} holds one motion of one body: leave out {name}={value!r}")


def _placed(path: Path, reading: Reading, name: str) -> None:
    if reading.root not in ("auto", "absolute"):
        raise NotSupported(
            f"root={reading.root!r} is for BVH files; {name} states where {path} has its root"
        )


def _no_body_model(path: Path, reading: Reading) -> None:
    if reading.body_model is not None:
        raise NotSupported(f"a body model is for AMASS files, and {path} is none: leave it out")


def _begins_as_json(head: bytes) -> bool:
    return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")


BVH = Format("BVH", (".bvh",), lambda head: b"HIERARCHY" in head.upper(), _read_bvh, written=(".bvh",))
GLTF = Format(
    "glTF",
    (".glb", ".gltf"),
    lambda head: head.startswith(MAGIC) or _begins_as_json(head),
    _read_gltf,
    gltf.takes,
    written=(".glb",),
)
AMASS = Format("AMASS", (".npz",), begins_as_archive, _read_amass, written=(".npz",))
JOINT_ARRAY = Format("joint array", (".npy",), lambda head: head.startswith(NPY), _read_joint_array)
FORMATS = (BVH, GLTF, AMASS, JOINT_ARRAY)
"""All formats, the first for files that nothing recognises."""
