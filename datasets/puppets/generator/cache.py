"""Cache on disk: one sealed file per clip or mesh, rebuilt when it is damaged or another's."""

import io
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import cache_folder, read_sealed, slug, write_sealed

Arrays = Mapping[str, np.ndarray]


def cached(identity: str, name: str, names: frozenset[str], build: Callable[[], Arrays]) -> Arrays:
    """The arrays called ``names`` of one clip: from the cache if they are there and whole, else built.

    identity: of the corpus; what another generator or seed has kept is never read. A folder that cannot be
    written costs time and nothing else. Any number of processes may ask at once.
    """
    path = cache_folder() / "puppets" / slug(identity) / f"{slug(name)}.npz"
    key = f"{identity} {name}"
    if (data := read_sealed(path, key)) is not None:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            if names == set(archive.files):
                return {name: archive[name] for name in archive.files}
    built = build()
    members: dict[str, Any] = dict(built)
    content = io.BytesIO()
    np.savez(content, **members)
    with suppress(FileError):
        write_sealed(path, key, content.getvalue())
    return built
