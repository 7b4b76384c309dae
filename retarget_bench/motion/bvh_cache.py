"""Parsed files kept in binary, under the hash of their text.

One file per document: a line with the format and a checksum, a line of JSON with the joints, then the
numbers as they lie in memory, so that reading it copies nothing.
"""

from __future__ import annotations

import hashlib
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic, cache_folder
from retarget_bench.motion.bvh_document import POSITIONS, ROTATIONS, Document, Hierarchy
from retarget_bench.motion.skeleton import EndSite

_FORMAT = b"retarget-bench bvh 1"
_ALIGN = 64
_CODES = dict(zip((*POSITIONS, *ROTATIONS), "XYZxyz", strict=True))
_CHANNELS = {code: name for name, code in _CODES.items()}


def place(data: bytes) -> Path:
    """Where the document of a file with this content is kept."""
    return cache_folder() / "bvh" / f"{hashlib.sha256(data).hexdigest()}.bin"


def load(path: Path) -> Document | None:
    """The document kept there, or None when there is none or it is damaged."""
    try:
        data = path.read_bytes()
        first, second, _ = data[: 1 << 20].split(b"\n", 2)
        start = len(first) + 1
        if first != _FORMAT + b" %08x" % zlib.crc32(memoryview(data)[start:]):
            return None
        facts: dict[str, Any] = json.loads(second)
    except (OSError, ValueError):
        return None
    numbers = np.frombuffer(data, dtype="<f8", offset=start + len(second) + 1)
    joints = len(facts["names"])
    hierarchy = Hierarchy(
        names=tuple(facts["names"]),
        parents=np.array(facts["parents"], dtype=np.int64),
        offsets=np.array(facts["offsets"]).reshape(joints, 3),
        channels=tuple(tuple(_CHANNELS[code] for code in codes) for codes in facts["channels"]),
        end_sites=tuple(EndSite(parent, (x, y, z)) for parent, x, y, z in facts["end_sites"]),
    )
    return Document(hierarchy, facts["frame_time"], numbers.reshape(-1, hierarchy.columns))


def save(path: Path, document: Document) -> None:
    """Keep a document. A cache that cannot be written is no reason to fail: then nothing is kept."""
    hierarchy = document.hierarchy
    facts = {
        "names": hierarchy.names,
        "parents": hierarchy.parents.tolist(),
        "offsets": hierarchy.offsets.ravel().tolist(),
        "channels": ["".join(_CODES[name] for name in names) for names in hierarchy.channels],
        "end_sites": [(site.parent, *site.offset) for site in hierarchy.end_sites],
        "frame_time": document.frame_time,
    }
    second = json.dumps(facts, separators=(",", ":")).encode()
    filled = len(_FORMAT) + 10 + len(second) + 1
    second += b" " * (-filled % _ALIGN) + b"\n"
    body = second + document.values.astype("<f8").tobytes()
    try:
        with atomic(path) as temporary:
            temporary.write_bytes(_FORMAT + b" %08x\n" % zlib.crc32(body) + body)
    except FileError:
        return
