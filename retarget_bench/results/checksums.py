"""Checksums of result files: a file that was cut, edited or mixed up gives no number.

A table that lost its end at a line's end still reads as one, and its means look like any others. Parquet
files are large, and read in part: their size and their list of contents are compared before, and pages as
they are read.
"""

import hashlib
from functools import lru_cache
from pathlib import Path

from retarget_bench.errors import FileError
from retarget_bench.files import check_ordinary
from retarget_bench.results.header import StoredFile

DIGITS = 32
"""Hex digits of a SHA-256 that headers hold."""
CHANGED = "is not as it was written"


def stored_file(path: Path) -> StoredFile:
    """What a header says of a file that was just written."""
    rows = _rows(path.read_bytes()) if path.suffix == ".csv" else None
    footer = _footer(path) if path.suffix == ".parquet" else ""
    return StoredFile(sha256=_digest(path, *_state(path)), rows=rows, footer=footer)


def problem(path: Path, written: StoredFile, *, whole: bool = False) -> str:
    """The reason why a file is not the one that was written; "" where it is. whole: read all of it."""
    try:
        check_ordinary(path)
        quick = bool(written.footer) and not whole
        if (quick and _footer(path) == written.footer) or (
            not quick and _digest(path, *_state(path)) == written.sha256
        ):
            return ""
        content = path.read_bytes()
    except FileError as error:
        return error.problem
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    if written.rows is None or written.footer:
        return CHANGED
    # a checkout may have changed line ends, which no number depends on
    if _sha256(content.replace(b"\r\n", b"\n")) == written.sha256:
        return ""
    rows = _rows(content)
    return CHANGED if rows == written.rows else f"has {rows} rows instead of the {written.rows} written"


def _rows(content: bytes) -> int:
    """Lines below the heading."""
    return max(0, content.count(b"\n") - 1)


def _footer(path: Path) -> str:
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(0, size - 8))
        length = 8 + int.from_bytes(file.read(8)[:4], "little")
        file.seek(max(0, size - length))
        return _sha256(b"%d\n" % size + file.read())


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
