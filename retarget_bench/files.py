"""Files: checks before reading, atomic writes, the user's cache folder, names that are safe everywhere."""

import codecs
import csv
import errno
import glob
import hashlib
import io
import json
import math
import os
import re
import secrets
import shutil
import stat
import tomllib
import unicodedata
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile, gettempdir
from typing import Any, Literal

from retarget_bench.errors import BenchError, FileError

_UNSAFE = re.compile(r"[^a-z0-9_.-]+")
_LONGEST_SLUG = 60
LOCK = ".lock"
"""The lock file of a folder that one process alone may write to."""
_DRAWN, _KEPT = 6, 40
"""Random bytes in the name of a temporary file, and how many letters of the whole one's name it keeps."""
SCRATCH = "retarget-bench-"
"""How the names of folders for files between processes begin, in the system's folder for them."""
_SEAL = hashlib.blake2b().digest_size
LARGEST = 4 << 30
"""Bytes of a motion file: as text some hours of a body at 120 frames per second."""
_LARGEST_TEXT, _DEEPEST = 1 << 28, 30
"""Bytes of a file of JSON or TOML, and how deep lists and objects of one may be nested."""
_STAND_INS = {
    "a Git LFS pointer: run `git lfs pull` where it came from": (
        b"version https://git-lfs",
        b"version http://git-media",
    ),
    "a git-annex pointer: run `git annex get` where it came from": (b"/annex/objects",),
    "a web page: the download gave a page, as of an error, instead of the file": (
        *(b"<!doctype", b"<html", b"<head", b"<!--"),
        *(b"404: not found", b"entry not found"),
    ),
}
"""Kinds of files that lie in the place of others -> what they begin with, in small letters."""
_HEAD = 64
"""Bytes that tell them."""
_FORMULA = ("=", "+", "-", "@")
"""Signs that spreadsheets take for the beginning of a formula."""


def check_ordinary(path: str | Path, most: float = math.inf) -> None:
    """Raises FileError for anything but an ordinary file, which reading could wait for or never end, for
    one of more than ``most`` bytes, and for what stands in for a file (``stand_in``). A missing file
    passes: opening it fails."""
    try:
        status = Path(path).stat()
    except (OSError, ValueError):
        return
    if stat.S_ISDIR(status.st_mode):
        raise FileError(path, "is a folder")
    if not stat.S_ISREG(status.st_mode):
        kinds = {stat.S_IFIFO: "pipe", stat.S_IFSOCK: "socket"}
        kind = kinds.get(stat.S_IFMT(status.st_mode), "device")
        raise FileError(path, f"is not an ordinary file but a {kind}: save what it gives to a file")
    if status.st_size > most:
        sizes = f"{status.st_size / 1e9:,.4g} GB; files of up to {most / 1e9:.2g} GB are read"
        raise FileError(path, f"has {sizes}: cut it into parts, or see whether it is damaged")
    with suppress(OSError), Path(path).open("rb") as file:
        if meaning := stand_in(file.read(_HEAD)):
            raise FileError(path, f"is {meaning}")


def stand_in(head: bytes) -> str:
    """The kind of pointer to a file, or page in its place, that begins with these bytes; "" for others."""
    head = head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    return next((meaning for meaning, beginnings in _STAND_INS.items() if head.startswith(beginnings)), "")


def read_json(path: Path, most: int = _LARGEST_TEXT) -> Any:
    """The content of a JSON file of at most so many bytes, in UTF-8, or UTF-16 with a byte order mark.
    Raises FileError where it is none, or is nested too deeply to be walked."""
    return _content(path, json.loads, "JSON", most)


def read_toml(path: Path, most: int = _LARGEST_TEXT) -> dict[str, Any]:
    """The same of a TOML file."""
    content: dict[str, Any] = _content(path, tomllib.loads, "TOML", most)
    return content


def _content(path: Path, loads: Callable[[str], Any], name: str, most: int) -> Any:
    check_ordinary(path, most)
    try:
        with path.open("rb") as file:
            utf_16 = file.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
        content = loads(path.read_text(encoding="utf-16" if utf_16 else "utf-8-sig"))
        if nesting(content) > _DEEPEST:
            raise RecursionError
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error
    except ValueError as error:  # also numbers of thousands of digits
        raise FileError(path, f"is not {name}: {error}") from error
    except RecursionError as error:
        raise FileError(path, f"is not {name} that can be read: it is nested too deeply") from error
    return content


def nesting(content: object) -> int:
    """The number of levels of lists and objects of JSON or TOML."""
    level, depth = [content], 0
    while level := [each for each in level if isinstance(each, dict | list)]:
        level = [one for each in level for one in (each.values() if isinstance(each, dict) else each)]
        depth += 1
    return depth


@contextmanager
def atomic(path: str | Path) -> Iterator[Path]:
    """A temporary path beside ``path``; renamed to it on success, removed on failure.

    Whoever reads ``path`` sees the old file or the whole new one, whenever the process dies.
    Raises FileError when the folder cannot be written or the disk is full.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{secrets.token_hex(_DRAWN)}.{path.name[-_KEPT:]}")
        try:
            yield temporary
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror or error})") from error


def sweep(path: Path) -> None:
    """Remove temporary files that killed processes left of a file that no other process is writing."""
    for left in path.parent.glob(f".{'[0-9a-f]' * 2 * _DRAWN}.{glob.escape(path.name[-_KEPT:])}"):
        left.unlink(missing_ok=True)


def check_writable(path: str | Path) -> None:
    """Raises FileError where ``atomic`` could not write a file, before it is made; nothing is left behind.

    The nearest folder that there is takes a temporary file, or does not.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        with suppress(FileNotFoundError):
            path.lstat()  # of names that are too long, or below a file
        folder = next(each for each in path.absolute().parents if os.path.lexists(each))
        with TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror or error})") from error


def write_text(path: str | Path, text: str) -> None:
    """Write UTF-8 with LF line ends, atomically."""
    with atomic(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_csv(path: str | Path, fields: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a heading and rows as comma-separated UTF-8 with LF line ends, atomically."""
    with atomic(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(fields)
        writer.writerows(rows)


def write_sealed(path: Path, key: str, data: bytes) -> None:
    """Write a file of a cache, which ``read_sealed`` gives back for the same key, atomically."""
    with atomic(path) as temporary, temporary.open("wb") as file:
        file.write(_seal(key, data))
        file.write(data)


def read_sealed(path: Path, key: str) -> bytes | None:
    """The data that were written there for this key; None where they are not, or not whole.

    key: all that decides the data, the version of what made them included.
    """
    try:
        with path.open("rb", buffering=0) as file:  # a buffer would cost a copy
            seal, data = file.read(_SEAL), file.readall()
    except OSError:
        return None
    return data if seal == _seal(key, data) else None


def _seal(key: str, data: bytes) -> bytes:
    total = hashlib.blake2b(hashlib.sha256(key.encode()).digest())
    total.update(data)
    return total.digest()


def spreadsheet(rows: Iterable[Sequence[object]], quoting: Literal[0, 1] = csv.QUOTE_MINIMAL) -> str:
    """Rows as comma-separated text for people and their spreadsheets; None is an empty cell.

    Characters without a shape become spaces, and a text that would be a formula begins with an apostrophe.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n", quoting=quoting)
    writer.writerows([_cell("" if each is None else str(each)) for each in row] for row in rows)
    return out.getvalue()


def _cell(text: str) -> str:
    shown = "".join(each if each.isprintable() else " " for each in text)
    if not shown.lstrip().startswith(_FORMULA):
        return shown
    try:
        float(shown)
    except ValueError:
        return f"'{shown}"
    return shown


@contextmanager
def locked(path: Path, busy: str) -> Iterator[None]:
    """A lock file that only this process holds, in a folder that is made where there is none; what was made
    in vain is removed again.

    The system lets go of the lock when the process ends, however it ends. Raises BenchError that says
    ``busy`` where another process has it, FileError where the folder cannot be written.
    """
    from filelock import FileLock, Timeout  # imports asyncio, which most commands do without

    new_folders = [each for each in path.parents if not each.exists()]
    lock = FileLock(path)
    try:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            lock.acquire(timeout=0)
        except Timeout as error:
            raise BenchError(busy) from error
        except OSError as error:
            raise FileError(path, f"cannot be written ({error.strerror or error})") from error
        try:
            yield
        finally:
            # while it is still locked, or the next process's lock would be removed
            with suppress(OSError):  # Windows removes no open file
                path.unlink(missing_ok=True)
            lock.release()
    finally:
        with suppress(OSError):  # not empty
            for each in new_folders:
                each.rmdir()


def cache_folder() -> Path:
    """The folder of parsed motions and generated data between runs: ``RETARGET_BENCH_CACHE``, else
    ``retarget-bench`` in the user's cache folder."""
    if folder := os.environ.get("RETARGET_BENCH_CACHE"):
        # in full, since processes that are started from here on work in other folders
        os.environ["RETARGET_BENCH_CACHE"] = str(Path(folder).absolute())
        return Path(os.environ["RETARGET_BENCH_CACHE"])
    from platformdirs import user_cache_path  # not needed by methods in other environments

    return user_cache_path("retarget-bench", appauthor=False)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """A folder for files between processes, gone afterwards; those of processes that were killed go now."""
    import psutil

    for left in Path(gettempdir()).glob(f"{SCRATCH}*"):
        owner = left.name.removeprefix(SCRATCH).partition("-")[0]
        if owner.isdecimal() and not psutil.pid_exists(int(owner)):
            shutil.rmtree(left, ignore_errors=True)
    with TemporaryDirectory(prefix=f"{SCRATCH}{os.getpid()}-", ignore_cleanup_errors=True) as folder:
        yield Path(folder)


def slug(name: str) -> str:
    """A file name for ``name``: ``[a-z0-9_.-]``, at most 60 characters, different for different names.

    A name that is already of that form stays as it is; any other gets eight hex digits of its hash.
    """
    plain = _UNSAFE.sub("-", name.lower()).strip("-.")
    if plain == name and len(name) <= _LONGEST_SLUG:
        return name
    return f"{plain[: _LONGEST_SLUG - 9]}-{digest(name)}"


def composed(name: str) -> str:
    """The name with composed letters (NFC), by which equal names compare as equal: archives of a Mac have
    them decomposed."""
    return unicodedata.normalize("NFC", name)


def free_name(name: str, taken: Container[str]) -> str:
    """``name``, or ``name-2`` and so on where that is taken."""
    numbered = (f"{name}-{number}" for number in count(2))
    return name if name not in taken else next(each for each in numbered if each not in taken)


def digest(text: str, digits: int = 8) -> str:
    """The first hex digits of the SHA-256 of ``text``."""
    return hashlib.sha256(text.encode()).hexdigest()[:digits]


def facts_digest(facts: Mapping[str, Any]) -> str:
    """Sixteen hex digits that stand for declared facts, whatever their order."""
    return digest(json.dumps(facts, sort_keys=True, separators=(",", ":"), allow_nan=False), 16)
