"""Arrays of NumPy's files, checked before they are loaded: nothing is unpickled, and nothing is larger than
its file says.

After NumPy's description of the format (numpy.lib.format), version 1.0 to 3.0.
"""

from __future__ import annotations

import math
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy

from retarget_bench.errors import FileError
from retarget_bench.motion.file_kinds import check_kind

_MOST = 1 << 26
"""Numbers in one array: 512 MB in double precision."""
_BROKEN = (
    *(OSError, EOFError, ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError),
    *(SyntaxError, RecursionError, MemoryError, RuntimeError),
    *(zipfile.BadZipFile, zlib.error, tokenize.TokenError),
)
"""Exceptions of zipfile and of the parser of array headers on damaged files."""
_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


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
