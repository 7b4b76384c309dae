"""Cache on disk: one file per clip or mesh, written atomically, rebuilt when it is damaged."""

import zipfile
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
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
    # absent, cut, altered (the archive has check sums) or of another make
    unreadable = OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError
    with suppress(*unreadable), np.load(path, allow_pickle=False) as archive:
        if names == set(archive.files):
            return {name: archive[name] for name in archive.files}
    built = build()
    members: dict[str, Any] = dict(built)
    with suppress(FileError), atomic(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **members)
    return built
