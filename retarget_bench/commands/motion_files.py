"""Motion files as commands take them, with how they are read in brackets: ``walk.bvh[unit=cm,up=z]``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench.errors import BenchError
from retarget_bench.plugins.spec import read_parameters

if TYPE_CHECKING:
    from retarget_bench.motion.files.reading import Reading

_BRACKETS = re.compile(r"\[(?=\s*\w+\s*=)")


@dataclass(frozen=True)
class MotionFile:
    """A motion file, or a folder of them, and how it is read. path: a take may stand behind a ``#``."""

    path: Path
    reading: Reading

    @classmethod
    def parse(cls, text: str) -> MotionFile:
        """``walk.bvh``, ``walk.bvh[unit=cm]``, ``Fox.glb#Walk[reading=reading.toml,unit=m]``; a file whose
        own name is such is that file. Raises BenchError for what cannot be read."""
        from retarget_bench.motion.files import split_take
        from retarget_bench.motion.files.reading import Reading

        places = [match.start() for match in _BRACKETS.finditer(text)]
        if not places or Path(text).exists():
            return cls(Path(text), Reading())
        at = next((each for each in places if split_take(text[:each])[0].exists()), places[0])
        written = "a file is written FILE[unit=cm,up=z], or FILE[reading=FILE.toml]"
        try:
            return cls(Path(text[:at]), Reading.of(read_parameters(text[at:], written)))
        except BenchError as error:
            raise BenchError(f"{text[:at]}: {error}") from error


class _Type(click.ParamType):
    name = "FILE[...]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> MotionFile:
        del param, ctx
        return value if isinstance(value, MotionFile) else MotionFile.parse(value)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[click.shell_completion.CompletionItem]:
        return click.Path().shell_complete(ctx, param, incomplete)


MOTION_FILE = _Type()
