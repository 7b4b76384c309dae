"""Parsed files kept in binary, under the hash of their text.

A kept document is one sealed file: a line of JSON with the joints, then the numbers as they lie in memory,
so that reading it copies nothing. The seal covers the hash of the text too, so what was cut, altered or
exchanged is not there. A path leads to that hash, by a sealed file of its own, as long as its size and
times do not change, because hashing the text takes longer than reading what is kept of it. Nothing here
ever fails: a cache that is damaged or cannot be written is as good as none.
"""

import hashlib
import json
import time
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import cache_folder, read_sealed, write_sealed
from retarget_bench.motion.bvh.document import POSITIONS, ROTATIONS, Document, Hierarchy
from retarget_bench.motion.skeleton import EndSite

_VERSION = "bvh 2"
"""Moves when the parser gives another document for any text, or a document is kept in another form."""
_LINE = 64
_CODES = dict(zip((*POSITIONS, *ROTATIONS), "XYZxyz", strict=True))
_CHANNELS = {code: name for name, code in _CODES.items()}
_SETTLED = 2.0
"""Seconds after a change before a file's times are trusted: two changes may bear the same time."""


def stamp(path: Path) -> str:
    """A hash of a path with its present size and times; "" while the file is young."""
    try:
        stat = path.stat()
    except OSError:
        return ""
    if not max(stat.st_mtime, stat.st_ctime) < time.time() - _SETTLED:
        return ""
    facts = (str(path.absolute()), stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_ino)
    return hashlib.sha256(repr(facts).encode()).hexdigest()


def content_hash(stamped: str) -> str:
    """The hash of the text of a file with this stamp; "" where it is not known."""
    stored = read_sealed(_by_path(stamped), f"{_VERSION} {stamped}") if stamped else None
    return "" if stored is None else stored.decode()


def remember(stamped: str, text: str) -> None:
    """Let a file with this stamp be known by the hash of its text."""
    if stamped:
        with suppress(FileError):
            write_sealed(_by_path(stamped), f"{_VERSION} {stamped}", text.encode())


def load(text: str) -> Document | None:
    """The document kept of a text with this hash, or None when there is none or it is damaged."""
    data = read_sealed(_by_text(text), f"{_VERSION} {text}") if text else None
    if data is None:
        return None
    end = data.index(b"\n") + 1
    hierarchy, frame_time = _facts(data[:end])
    values = np.frombuffer(data, dtype="<f8", offset=end)
    return Document(hierarchy, frame_time, values.reshape(-1, hierarchy.columns))


def save(text: str, document: Document) -> None:
    """Keep the document of a text with this hash."""
    hierarchy = document.hierarchy
    facts = {
        "names": hierarchy.names,
        "parents": hierarchy.parents.tolist(),
        "offsets": hierarchy.offsets.tolist(),
        "channels": ["".join(_CODES[name] for name in names) for names in hierarchy.channels],
        "end_sites": [(site.parent, *site.offset) for site in hierarchy.end_sites],
        "frame_time": document.frame_time,
    }
    line = json.dumps(facts, separators=(",", ":")).encode()
    line += b" " * (-(len(line) + 1) % _LINE) + b"\n"
    with suppress(FileError):
        write_sealed(_by_text(text), f"{_VERSION} {text}", line + document.values.astype("<f8").tobytes())


def _by_path(stamped: str) -> Path:
    return cache_folder() / "bvh" / "by_path" / f"{stamped}.bin"


def _by_text(text: str) -> Path:
    return cache_folder() / "bvh" / f"{text}.bin"


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
