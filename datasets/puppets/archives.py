"""The files of the frozen corpus: ``.npz`` archives and a list of what is in them, all with check sums.

Floats are stored with their bytes shuffled, as HDF5's shuffle filter does: all first bytes, then all second
ones, and so on. The high bytes of a smooth motion hardly change, and together they compress.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic, write_text

SUMS = "sums.json"
"""File -> SHA-256 of its content."""
_FLOATS = {4: "<f4", 8: "<f8"}


class Archive(Mapping[str, np.ndarray]):
    """Arrays of an ``.npz`` file by name, each read on access."""

    def __init__(self, content: bytes) -> None:
        self._file = np.load(io.BytesIO(content), allow_pickle=False)

    def __getitem__(self, name: str) -> np.ndarray:
        array: np.ndarray = self._file[name]
        return _joined(array) if array.dtype == np.uint8 else array

    def __iter__(self) -> Iterator[str]:
        return iter(self._file.files)

    def __len__(self) -> int:
        return len(self._file.files)


def read(folder: Path, name: str) -> bytes:
    """The content of a file. Raises FileError where it is missing, or not as it was written."""
    try:
        expected = json.loads((folder / SUMS).read_text(encoding="utf-8")).get(name)
        content = (folder / name).read_bytes()
    except (OSError, ValueError, AttributeError) as error:
        raise FileError(folder / name, f"cannot be read ({error}); install the package again") from error
    if _sum(name, content) != expected:
        raise FileError(
            folder / name, "is damaged (its check sum is another one); install the package again"
        )
    return content


def write(folder: Path, archives: Mapping[str, Mapping[str, np.ndarray]], index: Any) -> None:
    """Write archives and ``index.json``, then the check sums of all. Equal arrays give equal bytes."""
    for name, arrays in archives.items():
        members: dict[str, Any] = {
            key: _shuffled(array) if array.dtype.kind == "f" else array for key, array in arrays.items()
        }
        with atomic(folder / f"{name}.npz") as temporary, temporary.open("wb") as stream:
            np.savez_compressed(stream, **members)
    write_text(folder / "index.json", json.dumps(index, indent=1) + "\n")
    names = sorted(path.name for path in folder.iterdir() if path.name != SUMS)
    sums = {name: _sum(name, (folder / name).read_bytes()) for name in names}
    write_text(folder / SUMS, json.dumps(sums, indent=1) + "\n")


def _sum(name: str, content: bytes) -> str:
    if name.endswith(".json"):  # a checkout may have changed line ends
        content = content.replace(b"\r\n", b"\n")
    return hashlib.sha256(content).hexdigest()


def _shuffled(array: np.ndarray) -> np.ndarray:
    """``(bytes of a number, ...)``"""
    plain = np.array(array, dtype=_FLOATS[array.dtype.itemsize], order="C")
    return np.array(np.moveaxis(plain[..., None].view(np.uint8), -1, 0), order="C")


def _joined(shuffled: np.ndarray) -> np.ndarray:
    together = np.array(np.moveaxis(shuffled, 0, -1), order="C")
    return np.asarray(together.view(_FLOATS[len(shuffled)])[..., 0])
