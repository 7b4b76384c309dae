"""What a folder of results was made of, so that a second run does only what is new or has changed.

A line of JSON for every result, appended when it is written; of two lines on one result the later counts.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

from retarget_bench import __version__, defaults
from retarget_bench.commands.retargeting.job import Job
from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import check_ordinary, write_text
from retarget_bench.motion import files as formats
from retarget_bench.motion.editing.edits import Edits
from retarget_bench.motion.files.formats import BVH
from retarget_bench.motion.files.listing import facts
from retarget_bench.motion.files.reading import Reading
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.code_hash import code_hash, package_code
from retarget_bench.python.plans import method_spec

NAME = "retarget.jsonl"
_DECIDE = ("seed", "fps", *(each.name for each in fields(Edits)))
"""Options that decide a result, beside the method."""


@dataclass(frozen=True)
class Record:
    """A result. key: of all that decides it. verdict: as JSON has it, None where there was none. content:
    a hash of its file, by which one that was changed or damaged since is known."""

    key: str
    verdict: Mapping[str, Any] | None
    content: str


class Records:
    """The records of a folder, by the result's path in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / NAME
        self._found = _read(self.path)

    def of(self, out: Path) -> Record | None:
        return self._found.get(self._name(out))

    def add(self, out: Path, record: Record) -> None:
        """Raises FileError where it cannot be written."""
        self._found[self._name(out)] = record
        try:
            with self.path.open("a", encoding="utf-8", newline="\n") as file:
                file.write(_line(self._name(out), record))
        except OSError as error:
            raise FileError(self.path, f"cannot be written ({error.strerror or error})") from error

    def tidy(self) -> None:
        """One line for each result, in order."""
        write_text(self.path, "".join(_line(name, self._found[name]) for name in sorted(self._found)))

    def _name(self, out: Path) -> str:
        return out.relative_to(self.folder).as_posix()


def _line(name: str, record: Record) -> str:
    return json.dumps({"result": name, **asdict(record)}) + "\n"


def _read(path: Path) -> dict[str, Record]:
    """What can be read; the last line of a run that was killed may be cut off."""
    found: dict[str, Record] = {}
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return found
    for line in lines:
        try:
            entry = json.loads(line)
            found[entry["result"]] = Record(entry["key"], entry["verdict"], entry["content"])
        except (ValueError, KeyError, TypeError):
            continue
    return found


def key(job: Job) -> str:
    """A hash of all that decides a result: both files and how they are read, the method with its code and
    weights, what is edited.

    Raises BenchError where a file or the method cannot be read.
    """
    method = registry.canonical("methods", method_spec(job.options.method or defaults.METHOD))
    said = {
        "version": __version__,
        "source": [_content(job.source.path), _facts(job.source.reading)],
        "target": [_content(job.target.path), _facts(job.target.reading)],
        "method": str(bound.method(method).known_as),
        "code": bound.method(method).code,
        "edits": code_hash(package_code("motion.editing")),
        "options": {name: getattr(job.options, name) for name in _DECIDE},
    }
    text = json.dumps(said, sort_keys=True)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]


def _facts(reading: Reading) -> dict[str, Any]:
    """What is said of a file. The content of files that it names counts; a folder counts by its name."""
    return reading.stated | {
        name: file_hash(path) if path.is_file() else str(path) for name, path in reading.files.items()
    }


def _content(path: Path) -> str:
    """A hash of a motion file and of the files that it refers to."""
    own = formats.split_take(path)[0]
    try:
        stat = own.stat()
    except OSError as error:
        raise FileError(own, f"cannot be read ({error.strerror or error})") from error
    return _content_of(path, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=64)
def _content_of(path: Path, changed: int, size: int) -> str:
    del changed, size
    if formats.format_of(path) is BVH:
        return file_hash(path)
    try:
        return facts(path)[0]
    except BenchError:  # bones of an AMC file that an option names: their content counts with the option
        return file_hash(formats.split_take(path)[0])


def file_hash(path: Path) -> str:
    """Raises FileError where the file cannot be read."""
    check_ordinary(path)
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error
