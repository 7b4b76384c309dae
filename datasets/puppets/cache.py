"""Cache on disk: one file per clip or mesh, written atomically, rebuilt when it is damaged."""

import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic, cache_folder, slug

Arrays = Mapping[str, np.ndarray]


def kept(identity: str, name: str, names: frozenset[str], build: Callable[[], Arrays]) -> Arrays:
    """The arrays called ``names`` of one clip: from the cache if they are there and whole, else built.

    identity: of the corpus; what another generator or seed has kept is never read. A folder that cannot be
    written costs time and nothing else. Any number of processes may ask at once.
    """
    path = cache_folder() / "puppets" / slug(identity) / f"{slug(name)}.npz"
    found = _read(path, names)
    if found is not None:
        return found
    built = build()
    _write(path, built)
    return built


def _read(path: Path, names: frozenset[str]) -> Arrays | None:
    """None where the file is absent, cut, altered (the archive has check sums) or of another make."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files} if names == set(archive.files) else None
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError):
        return None


def _write(path: Path, arrays: Arrays) -> None:
    members: dict[str, Any] = dict(arrays)
    try:
        with atomic(path) as temporary, temporary.open("wb") as file:
            np.savez(file, **members)
    except FileError:
        return
