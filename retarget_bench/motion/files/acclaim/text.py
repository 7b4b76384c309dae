"""Lines and numbers of Acclaim files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from retarget_bench.errors import FileError
from retarget_bench.motion.file_kinds import check_kind

_LONGEST = 1e9
"""No body is longer in any unit, and no angle larger."""
_BLANKS = str.maketrans(",()", "   ")


@dataclass
class Line:
    """A line with something in it, as words."""

    path: Path
    number: int
    words: list[str]

    def fault(self, problem: str) -> FileError:
        return FileError(self.path, problem, self.number)


def content(path: Path, name: str) -> bytes:
    """The bytes of an "ASF" or "AMC" file with LF at line ends. Raises FileError."""
    check_kind(path, name, text=True)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error
    data = data.removeprefix(b"\xef\xbb\xbf")
    return data if b"\n" in data else data.replace(b"\r", b"\n")


def lines(path: Path) -> Iterator[Line]:
    """The lines of an ASF file, without comments and blank ones; commas and brackets are blanks."""
    text = content(path, "ASF").decode("utf-8", "replace")
    for number, line in enumerate(text.split("\n"), 1):
        if words := line.partition("#")[0].translate(_BLANKS).split():
            yield Line(path, number, words)


def numbers(line: Line, words: Sequence[str], count: int) -> list[float]:
    """So many finite numbers. Raises FileError where these are others."""
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    sound = all(math.isfinite(each) and abs(each) <= _LONGEST for each in values)
    if len(values) != count or not sound or any("_" in word for word in words):
        text = " ".join(words)[:60]
        raise line.fault(
            f"expected {count} finite number{'s' * (count > 1)} behind {line.words[0][:40]!r}, "
            f"found {text!r}"
        )
    return values
