"""Errors that are meant for people: the command prints their text, never a traceback.

Text of files and plug-ins is made safe to show here, too.
"""

from __future__ import annotations

import traceback
import unicodedata
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError


def visible(text: str, *, lines: bool = True) -> str:
    """The text with escapes in place of characters that move the cursor, hide or reorder text.

    Names in files and messages of plug-ins may hold such. Tabs become spaces. lines: keep their ends.
    """
    return "".join(each if each.isprintable() or (lines and each == "\n") else _seen(each) for each in text)


def _seen(character: str) -> str:
    if unicodedata.category(character) == "Zs":  # spaces of other widths
        return character
    return " " if character == "\t" else character.encode("unicode_escape").decode()


def printable(text: str) -> str:
    """One line of visible text."""
    return visible(" ".join(text.split()))


class BenchError(Exception):
    """An error told in a sentence or two: what was wrong, where, and what to do about it."""

    def __init__(self, message: str = "") -> None:
        super().__init__(visible(str(message)))


class FileError(BenchError):
    """A file that cannot be read or written: the message starts with ``path:line:``."""

    def __init__(self, path: str | Path, problem: str, line: int | None = None) -> None:
        where = visible(str(path), lines=False) + (f":{line}" if line is not None else "")
        super().__init__(f"{where}: {problem}")
        self.path = Path(path)
        self.line = line
        self.problem = visible(problem)

    def __reduce__(self) -> tuple[type[FileError], tuple[Path, str, int | None]]:
        return (type(self), (self.path, self.problem, self.line))


class SkeletonError(BenchError):
    """A skeleton, character or motion whose parts do not fit together."""


class NotSupported(BenchError):
    """A request that is well formed but that the named plug-in cannot serve."""


class Unusable(BenchError):
    """Raised by a clip that nothing can be learnt from. Training goes on without it, and says
    why."""

    def __init__(self, clip: str, why: str) -> None:
        super().__init__(f"{clip}: {why}")
        self.clip, self.why = clip, why

    def __reduce__(self) -> tuple[type[Unusable], tuple[str, str]]:
        return type(self), (self.clip, self.why)


def one_line(error: BaseException) -> str:
    """An error of a plug-in, with the line that raised it."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    try:
        text = printable(str(error)) or "no message"
    except Exception:  # of a class of its own
        text = "no message that can be read"
    return f"{type(error).__name__}: {text[:300]} ({Path(where.filename).name}:{where.lineno})"


def mistakes(error: ValidationError) -> str:
    """Everything that pydantic found wrong with a file, each mistake with its field."""
    return "; ".join(f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in error.errors())


def some(names: Sequence[str], most: int = 6) -> str:
    """A list for messages: the first few names, and how many more."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
