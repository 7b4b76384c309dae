"""Arrays of NumPy's files, checked before they are loaded, and motions that are known by joint positions.

Nothing is unpickled, and nothing is larger than its file says (numpy.lib.format, version 1.0 to 3.0).
Features of HumanML3D are decoded by their definition (Guo et al. 2022, section 3, and its published code):
of 263 numbers a frame, the first four say how the root moves, the next 63 where the other joints are. The
rest (rotations, velocities, contacts) repeats these and is not read; the rotations of published features
are known not to fit the joints.
"""

from __future__ import annotations

import difflib
import math
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy

from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.file_kinds import check_kind
from retarget_bench.motion.files.smpl import skeletons
from retarget_bench.motion.files.smpl.skeletons import (
    ABOVE,
    BODY,
    BY_JOINTS,
    FAMILIES,
    H36M,
    SMPL,
    SMPLH,
    SMPLX,
    Family,
    of_joints,
)
from retarget_bench.motion.recording import Recording, of_positions

_MOST = 1 << 26
"""Numbers in one array: 512 MB in double precision."""
_BROKEN = (
    *(OSError, EOFError, ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError),
    *(SyntaxError, RecursionError, MemoryError, RuntimeError),
    *(zipfile.BadZipFile, zlib.error, tokenize.TokenError),
)
"""Exceptions of zipfile and of the parser of array headers on damaged files."""
_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


Joints = str | Sequence[str]
"""A skeleton's name, or names of joints."""
FAMILIES_BY_NAME = {"body": BODY, "smpl": SMPL, "smplh": SMPLH, "smplx": SMPLX, "h36m": H36M}
"""Skeletons whose joints are known by a name."""
FEATURES = 263
RATE = 20.0
"""Frames per second of HumanML3D."""
_FARTHEST = 1e9
_UNEVEN = 0.2
"""Share of its length by which a bone may vary in decoded features, most of the time."""


class Archive:
    """An ``.npz`` file: arrays by name, each read on access.

    Every method raises FileError in a sentence for what is damaged, of another kind or too large.
    """

    def __init__(self, path: Path) -> None:
        check_kind(path, "NPZ")
        self.path = path

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The arrays in the file."""
        with _readable(self.path), zipfile.ZipFile(self.path) as packed:
            listed = [item.filename for item in packed.infolist()]
        return tuple(name.removesuffix(".npy") for name in listed if name.endswith(".npy"))

    def numbers(self, name: str, columns: int | None = None) -> np.ndarray:
        """An array of finite numbers in double precision. columns: so many of the last axis, at most."""
        array = self._array(name, "fiu")
        if columns is not None and array.ndim:
            array = array[..., :columns]
        return finite(self.path, f"{name!r}", array)

    def text(self, name: str) -> str:
        """A text; "" where the array is none, or pickled."""
        try:
            array = self._array(name, "US")
        except FileError:
            return ""
        if array.size != 1:
            return ""
        value = array.reshape(-1)[0]
        return (value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)).strip()

    def _array(self, name: str, kinds: str) -> np.ndarray:
        with _readable(self.path), zipfile.ZipFile(self.path) as packed:
            item = packed.getinfo(f"{name}.npy")
            if item.compress_type not in _PACKED or item.flag_bits & 1:
                raise FileError(self.path, f"{name!r} is packed in a way that NumPy does not use")
            with packed.open(item) as file:
                return _read(self.path, f"{name!r}", file, item.file_size, kinds)


def read_array(path: Path) -> np.ndarray:
    """The numbers of an ``.npy`` file, finite, in double precision. Raises FileError."""
    check_kind(path, "NPY")
    with _readable(path), path.open("rb") as file:
        array = _read(path, "it", file, path.stat().st_size, "fiu")
    return finite(path, "it", array)


def finite(path: Path, what: str, array: np.ndarray) -> np.ndarray:
    """The array in double precision; raises FileError where a number is NaN or infinite."""
    with np.errstate(all="ignore"):
        values = np.asarray(array, dtype=np.float64)
    sound = np.isfinite(values)
    if not sound.all():
        row = f", first in row {int(np.argwhere(~sound)[0][0]) + 1}" if values.ndim else ""
        raise FileError(path, f"{what} holds NaN or infinity{row}: repair it, or leave those frames out")
    return values


def shape_text(shape: Sequence[int]) -> str:
    """``(300, 22, 3)``; of long ones the beginning."""
    inside = ", ".join(map(str, shape[:4])) + (", ..." if len(shape) > 4 else "")
    return f"({inside}{',' * (len(shape) == 1)})"


def check_shape(path: Path, name: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
    """Raise FileError where an array has another shape, or nothing in it."""
    if array.shape != shape or 0 in shape:
        raise FileError(
            path, f"has {name!r} of shape {shape_text(array.shape)}; {shape_text(shape)} is needed"
        )


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Raise FileError for everything that damaged files raise."""
    try:
        yield
    except FileError:
        raise
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error
    except _BROKEN as error:
        raise FileError(path, "is damaged or cut off: its arrays cannot be unpacked") from error


def _read(path: Path, what: str, file: IO[bytes], size: int, kinds: str) -> np.ndarray:
    """An array whose header fits the bytes that there are. kinds: accepted values of ``dtype.kind``."""
    shape, fortran, dtype = _header(file)
    if dtype.hasobject:
        raise FileError(
            path, f"{what} is a pickled object, which is never loaded: save it as an array of numbers"
        )
    if dtype.kind not in kinds or dtype.names is not None:
        expected = "text" if "U" in kinds else "numbers"
        raise FileError(path, f"{what} holds {dtype.name[:30]}, and {expected} are needed")
    if any(each < 0 for each in shape) or math.prod(shape) > _MOST:
        raise FileError(path, f"{what} is of shape {shape_text(shape)}, which is too large to be a motion")
    count = math.prod(shape)
    if file.tell() + count * dtype.itemsize != size:
        raise FileError(path, f"{what} is of shape {shape_text(shape)}, which does not fit its size")
    data = file.read(count * dtype.itemsize)
    if len(data) < count * dtype.itemsize:
        raise FileError(path, f"{what} is cut off")
    return np.frombuffer(data, dtype, count).reshape(shape, order="F" if fortran else "C")


def _header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, whether it is in Fortran's order, and kind of numbers. Raises whatever it does."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of headers written by Python 2
        version = npy.read_magic(file)
        if version not in ((1, 0), (2, 0), (3, 0)):
            raise ValueError(version)
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        return read(file)


# ---------------------------------------------------------------------------------------- joint positions
def recorded(path: Path, array: np.ndarray, rate: float | None = None, joints: Joints = ()) -> Recording:
    """The motion of an array of finite numbers, in metres; its skeleton has the bones that the positions
    show.

    path: what errors call it. rate: frames per second, where they are told: the array does not say them.
    joints: see ``family_of``; none: what its shape says. Raises FileError for other arrays.
    """
    if not len(array.shape) or not len(array):
        raise FileError(path, "has no frames")
    if np.abs(array).max(initial=0.0) > _FARTHEST:
        raise FileError(path, f"holds numbers above {_FARTHEST:g}: it is damaged")
    features = array.ndim == 2 and array.shape[1] == FEATURES
    family, positions = (BODY, from_features(array)) if features else (_family(path, array, joints), array)
    skeleton = skeletons.fitted_to(family, positions)
    if family not in FAMILIES:  # without a collar bone SMPL's left_shoulder would be taken for one
        skeleton = replace(skeleton, names=tuple(_roles()[name] for name in family.joints))
    if float(np.abs(skeleton.offsets).max()) < 1e-9:
        raise FileError(path, "has all joints in one place: it holds no body")
    doubts = []
    if features and _varies(positions, family) > _UNEVEN:
        doubts.append(
            "bones change their length: features that were normalised have to be multiplied by Std and "
            "moved by Mean first"
        )
    if rate is None:
        doubts.append(
            f"the rate is not stated: {RATE:g} frames per second as in HumanML3D; say rate=30 for Motion-X"
        )
    what = (
        f"features of HumanML3D, {FEATURES} a frame" if features else f"positions of {len(family)} joints"
    )
    return of_positions(
        skeleton,
        positions,
        rate or RATE,
        notes=(f"{what}, in the order of {family.name}",),
        doubts=tuple(doubts),
        unit="m",
        up="y" if features else "",
        rate_stated=False,
    )


def _family(path: Path, array: np.ndarray, joints: Joints) -> Family:
    family = family_of(joints) if joints else BY_JOINTS.get(array.shape[1] if array.ndim == 3 else 0)
    if family and array.ndim == 3 and array.shape[1:] == (len(family), 3):
        return family
    if family and joints:
        expected = f"positions of these joints are (frames, {len(family)}, 3)"
    else:
        shapes = ", ".join(f"(frames, {each}, 3)" for each in BY_JOINTS)
        expected = (
            f"joint positions of the SMPL family are {shapes}, and features of HumanML3D "
            f"(frames, {FEATURES})"
        )
    raise FileError(path, f"is of shape {shape_text(array.shape)}; {expected}")


def family_of(joints: Joints) -> Family:
    """A skeleton by its name, or of joints by their names, all roles or all SMPL's. Raises BenchError for
    others."""
    if isinstance(joints, str):
        if (family := FAMILIES_BY_NAME.get(joints.casefold().replace("-", ""))) is None:
            raise BenchError(f"no skeleton is known as {joints!r}; there are {', '.join(FAMILIES_BY_NAME)}")
        return family
    roles = {role: name for name, role in _roles().items()}
    by_name = roles if "hips" in joints else {name: name for name in ABOVE}
    if unknown := [each for each in joints if each not in by_name]:
        near = difflib.get_close_matches(unknown[0], by_name, 3) or list(by_name)[:3]
        raise BenchError(
            f"{unknown[0]!r} is no joint that is known; joints are named by their roles (hips, ...) or as "
            f"in SMPL (pelvis, ...), such as {', '.join(near)}"
        )
    names = [by_name[each] for each in joints]
    if names.count("pelvis") != 1 or len(set(names)) < len(names):
        raise BenchError("joints: each is named once, and the hips (in SMPL pelvis) are among them")
    same = (family for family in FAMILIES if family.joints == tuple(names))
    return next(same, of_joints("the joints named", names))


def _roles() -> dict[str, str]:
    """Joint of the SMPL family -> its role; one without a role -> a name that is none."""
    body = Character.of("body", skeletons.average(SMPLX))
    pairs = zip(SMPLX.joints, body.roles, strict=True)
    return {name: f"{name}_end" for name in ABOVE} | {name: role or name for name, role in pairs}


def from_features(features: np.ndarray) -> np.ndarray:
    """``(frames, 22, 3)`` metres, Y up, of features ``(frames, 263)``; the body begins over the origin and
    faces +Z there.

    A frame's first number is minus half the angle, radians, by which the body turns about Y to the next
    frame; the next two are the root's step to that frame, seen from there, and the fourth is its height.
    The other joints are seen from the root's place on the floor, facing +Z.
    """
    frames = len(features)
    half = np.zeros(frames)
    half[1:] = np.cumsum(features[:-1, 0])
    back = rotation.about(np.array([0.0, -1.0, 0.0]), 2.0 * half)  # from facing +Z to the world
    steps = np.zeros((frames, 3))
    steps[1:, [0, 2]] = features[:-1, 1:3]
    root = np.cumsum(rotation.rotate(back, steps), axis=0)
    root[:, 1] = features[:, 3]
    positions = np.empty((frames, len(BODY), 3))
    positions[:, 0] = root
    others = features[:, 4 : 4 + 3 * (len(BODY) - 1)].reshape(frames, -1, 3)
    positions[:, 1:] = rotation.rotate(back[:, None], others)
    positions[:, 1:, [0, 2]] += root[:, None, [0, 2]]
    return positions


def _varies(positions: np.ndarray, family: Family) -> float:
    """The largest share of its length by which a bone varies in the middle half of all frames."""
    parents = list(family.parents)
    lengths = np.linalg.norm(positions - positions[:, parents], axis=2)[:, 1:]
    low, middle, high = np.quantile(lengths, [0.25, 0.5, 0.75], axis=0)
    return float(((high - low) / np.maximum(middle, 1e-9)).max())
