"""Checksums of result files: a file that was cut, edited or mixed up gives no number.

A table that lost its end at a line's end still reads as one, and its means look like any others.
"""

import hashlib
from functools import lru_cache
from pathlib import Path

from retarget_bench.results.header import StoredFile

DIGITS = 32
"""Hex digits of a SHA-256 that headers hold."""


def stored_file(path: Path) -> StoredFile:
    """What a header says of a file that was just written."""
    rows = _rows(path.read_bytes()) if path.suffix == ".csv" else None
    return StoredFile(sha256=_digest(path, *_state(path)), rows=rows)


def problem(path: Path, written: StoredFile) -> str:
    """The reason why a file is not the one that was written; "" where it is."""
    try:
        if _digest(path, *_state(path)) == written.sha256:
            return ""
        content = path.read_bytes()
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    # a checkout may have changed line ends, which no number depends on
    if written.rows is not None and _sha256(content.replace(b"\r\n", b"\n")) == written.sha256:
        return ""
    if written.rows is not None and (rows := _rows(content)) != written.rows:
        return f"has {rows} rows instead of the {written.rows} that were written"
    return "is not as it was written"


def _rows(content: bytes) -> int:
    """Lines below the heading."""
    return max(0, content.count(b"\n") - 1)


def _state(path: Path) -> tuple[int, int]:
    stat = path.stat()
    return stat.st_mtime_ns, stat.st_size


@lru_cache(maxsize=1024)
def _digest(path: Path, changed: int, size: int) -> str:
    """Of a file in this state; methods of one split share their case list."""
    del changed, size
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:DIGITS]


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:DIGITS]
