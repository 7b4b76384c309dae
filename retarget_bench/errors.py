"""Errors that are meant for people: the command prints their text, never a traceback."""

from __future__ import annotations

import traceback
from pathlib import Path


class BenchError(Exception):
    """An error told in a sentence or two: what was wrong, where, and what to do about it."""


class FileError(BenchError):
    """A file that cannot be read or written: the message starts with ``path:line:``."""

    def __init__(self, path: str | Path, problem: str, line: int | None = None) -> None:
        where = f"{path}:{line}" if line is not None else f"{path}"
        super().__init__(f"{where}: {problem}")
        self.path = Path(path)
        self.line = line
        self.problem = problem

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
        text = " ".join(str(error).split()) or "no message"
    except Exception:  # of a class of its own
        text = "no message that can be read"
    return f"{type(error).__name__}: {text[:300]} ({Path(where.filename).name}:{where.lineno})"
