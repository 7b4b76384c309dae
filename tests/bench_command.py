"""The command in this process, two figures whose motions it is given, and methods in files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from retarget_bench import cli
from retarget_bench.commands.plugins import plugin_source
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import registry


class Done(NamedTuple):
    """Exit status, output and errors of a command."""

    code: int
    out: str
    err: str


@pytest.fixture
def bench(capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Runs ``bench`` with words."""

    def run(*arguments: object) -> Done:
        with pytest.raises(SystemExit) as stop:
            cli.main([str(each) for each in arguments])
        return Done(int(stop.value.code or 0), *capsys.readouterr())

    return run


def bowing(folder: Path) -> dict[str, Motion]:
    """Twenty frames of the figures ``small`` and ``large``; the data set that they are of is registered."""
    file = folder / "bows.py"
    file.write_text(plugin_source("dataset", "bows"))
    registry.add_file(file)
    data = registry.create("datasets", "bows[frames=20]")
    return {info.source: data.load(info).source for info in data.cases("retarget", "self")[:2]}


def method_file(folder: Path, name: str, answer: str) -> Path:
    """The template of a method as a file, with a last line of ``source``, ``target``, ``copied``."""
    text, usual = plugin_source("method", name), "return target.motion(copied.rotations, root, source.fps)"
    assert usual in text
    (folder / f"{name}.py").write_text(text.replace(usual, answer))
    return folder / f"{name}.py"
