"""Motion files of all formats, read by what they hold.

``read`` gives a file's motion as it states it; ``motion.importer.load`` then decides what it leaves
unsaid, for every format alike. Formats are listed in ``formats.py``. Of a file with several motions
(*takes*), one is named by a ``take``, or after a ``#`` in the path: ``Fox.glb#Walk`` or ``Fox.glb#2``.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion.file_kinds import kind_of
from retarget_bench.motion.files.formats import BVH, FORMATS, UNREADABLE, Format
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.recording import Recording

__all__ = [
    "FORMATS",
    "Format",
    "Reading",
    "format_of",
    "read",
    "split_take",
    "suffixes",
    "takes",
    "with_take",
]


def suffixes(*, written: bool = False) -> tuple[str, ...]:
    """The endings of motion files; ``written``: of those that results can be written as."""
    return tuple(each for form in FORMATS for each in (form.written if written else form.suffixes))


def format_of(path: str | Path) -> Format:
    """The format of a file, by what it is; else, and where it is not there, by its ending.

    What there is but no file that can be looked into is ``UNREADABLE``.
    """
    path = split_take(path)[0]
    by_name = next((form for form in FORMATS if path.suffix.lower() in form.suffixes), BVH)
    if not path.exists():
        return by_name
    try:
        kind = kind_of(path).name
    except FileError:
        return UNREADABLE
    return next((form for form in FORMATS if kind in form.kinds), by_name)


def read(path: str | Path, reading: Reading = Reading()) -> Recording:
    """The motion of a file, in its own axes and unit. Of the reading only what readers need counts.

    Raises FileError for what cannot be read, NotSupported where the file has no such take or body.
    """
    path, reading = with_take(path, reading)
    return format_of(path).read(path, reading)


def takes(path: str | Path) -> tuple[str, ...]:
    """The names of the motions in a file, "" for one without; () where the format has one a file."""
    path = split_take(path)[0]
    return format_of(path).takes(path)


def split_take(path: str | Path) -> tuple[Path, str | None]:
    """A path without the take that stands behind a ``#``, and that take."""
    path = Path(path)
    text = str(path)
    if "#" not in text or path.exists():
        return path, None
    for place in (n for n, sign in enumerate(text) if sign == "#"):
        if Path(text[:place]).is_file():
            return Path(text[:place]), text[place + 1 :] or None
    return path, None


def with_take(path: str | Path, reading: Reading) -> tuple[Path, Reading]:
    """A path without the take that stands behind a ``#``, and the reading with it. Raises NotSupported
    where the reading has another."""
    path, take = split_take(path)
    if take is None:
        return path, reading
    if reading.take not in (None, take):
        raise NotSupported(
            f"{path}#{take} names a take, and take={reading.take!r} is another: give one of them"
        )
    return path, replace(reading, take=take)
