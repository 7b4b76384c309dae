"""Parsed files kept in binary, under the hash of their text.

A kept document is one file: a line with the format and a checksum, a line of JSON with the joints, then
the numbers as they lie in memory, so that reading it copies nothing. A second name of that file stands for
a path as long as its size and times do not change, because hashing a file takes several times as long as
reading what is kept of it. Nothing here ever fails: a cache that is damaged or cannot be written is as good
as none.
"""

import hashlib
import json
import time
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic, cache_folder
from retarget_bench.motion.bvh.document import POSITIONS, ROTATIONS, Document, Hierarchy
from retarget_bench.motion.skeleton import EndSite

_FORMAT = b"retarget-bench bvh 1 "
_LINE = 64
_CODES = dict(zip((*POSITIONS, *ROTATIONS), "XYZxyz", strict=True))
_CHANNELS = {code: name for name, code in _CODES.items()}
_SETTLED = 2.0
"""Seconds after a change before a file's times are trusted: two changes may bear the same time."""


def place_by_path(path: Path) -> Path | None:
    """The cache file for a path with its present size and times; None while the file is young."""
    try:
        stat = path.stat()
    except OSError:
        return None
    if not max(stat.st_mtime, stat.st_ctime) < time.time() - _SETTLED:
        return None
    facts = (str(path.absolute()), stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_ino)
    name = hashlib.sha256(repr(facts).encode()).hexdigest()
    return cache_folder() / "bvh" / "by_path" / f"{name}.bin"


def place_by_content(data: bytes) -> Path:
    """The cache file for the content of a BVH file."""
    return cache_folder() / "bvh" / f"{hashlib.sha256(data).hexdigest()}.bin"


def load(place: Path | None) -> Document | None:
    """The document kept there, or None when there is none or it is damaged."""
    if place is None:
        return None
    try:
        data = place.read_bytes()
    except OSError:
        return None
    if len(data) % 8 or data[:_LINE] != _first_line(memoryview(data)[_LINE:]):
        return None
    end = data.index(b"\n", _LINE) + 1
    hierarchy, frame_time = _facts(data[_LINE:end])
    values = np.frombuffer(data, dtype="<f8", offset=end)
    return Document(hierarchy, frame_time, values.reshape(-1, hierarchy.columns))


def link(place: Path, other: Path | None) -> None:
    """Give a kept document another name. Where the file system has no links, it has one name only."""
    if other is None:
        return
    try:
        with atomic(other) as temporary:
            temporary.hardlink_to(place)
    except FileError:
        return


def save(place: Path, document: Document) -> None:
    """Keep a document."""
    hierarchy = document.hierarchy
    facts = {
        "names": hierarchy.names,
        "parents": hierarchy.parents.tolist(),
        "offsets": hierarchy.offsets.tolist(),
        "channels": ["".join(_CODES[name] for name in names) for names in hierarchy.channels],
        "end_sites": [(site.parent, *site.offset) for site in hierarchy.end_sites],
        "frame_time": document.frame_time,
    }
    second = json.dumps(facts, separators=(",", ":")).encode()
    second += b" " * (-(len(second) + 1) % _LINE) + b"\n"
    body = second + document.values.astype("<f8").tobytes()
    try:
        with atomic(place) as temporary:
            temporary.write_bytes(_first_line(body) + body)
    except FileError:
        return


def _first_line(body: bytes | memoryview) -> bytes:
    # a sum of words: damage does not cancel out by chance, and it costs a tenth of a CRC
    total = int(np.frombuffer(body, dtype="<u8").sum(dtype=np.uint64))
    return (_FORMAT + b"%016x" % total).ljust(_LINE - 1) + b"\n"


@lru_cache(maxsize=256)
def _facts(line: bytes) -> tuple[Hierarchy, float]:
    """Joints and frame time; the clips of a character share the line."""
    facts: dict[str, Any] = json.loads(line)
    hierarchy = Hierarchy(
        names=tuple(facts["names"]),
        parents=np.array(facts["parents"], dtype=np.int64),
        offsets=np.array(facts["offsets"], dtype=np.float64),
        channels=tuple(tuple(_CHANNELS[code] for code in codes) for codes in facts["channels"]),
        end_sites=tuple(EndSite(parent, (x, y, z)) for parent, x, y, z in facts["end_sites"]),
    )
    return hierarchy, facts["frame_time"]
