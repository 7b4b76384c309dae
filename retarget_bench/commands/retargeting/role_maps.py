"""Maps of joints to roles as files that ``--roles`` and ``--target-roles`` read."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from retarget_bench.errors import BenchError
from retarget_bench.files import write_text
from retarget_bench.motion.findings import NO_ROLE, Findings

_WHY = {reason: words.strip("-? ()") for reason, words in NO_ROLE.items()}
_UNSAFE = re.compile(r"[^\w.-]+")


def text(findings: Findings) -> str:
    """A role file of all joints of a body: those without a role are "none", with the reason."""
    lines = []
    for name, meaning in findings.joints:
        why = _WHY.get(meaning)
        lines.append(f"{_quoted(name)} = " + (f'"none"  # {why}' if why else f'"{meaning}"'))
    wanted = [f"# no joint is known as {', '.join(findings.missing)}"] if findings.missing else []
    return "\n".join([*wanted, *lines]) + "\n"


def _quoted(name: str) -> str:
    """A joint's name as a key of TOML: as JSON quotes it, but that DEL is escaped too."""
    return json.dumps(name, ensure_ascii=False).replace("\x7f", "\\u007f")


def save(path: Path, sources: Sequence[Findings], targets: Sequence[Findings]) -> list[str]:
    """Write the maps of sources to ``path``, and those of targets beside it with ``.target`` before the
    ending; where bodies of a side differ, one file for each, with the name of the first motion of it.

    Returns a line for each file. Raises BenchError.
    """
    if path.suffix.lower() != ".toml":
        raise BenchError(f"{path}: role maps are TOML files; end the name in .toml")
    lines = []
    for side, found in (("", sources), ("target", targets)):
        for name, (body, first) in _named(path, side, found).items():
            option = f"--{side}-roles" if side else "--roles"
            write_text(name, f"# joints of {first.path.name}; read by {option}\n{body}")
            lines.append(f"{name}: what joints are, for {option}")
    return lines


def of_target(path: Path) -> Path:
    """Where the map of one target is saved beside the one of one source."""
    return path.with_name(f"{path.stem}.target{path.suffix}")


def _named(path: Path, side: str, found: Sequence[Findings]) -> Mapping[Path, tuple[str, Findings]]:
    """Files and what they say, one for each different map."""
    maps: dict[str, Findings] = {}
    for each in found:
        maps.setdefault(text(each), each)
    parts = [side] if side else []
    named: dict[Path, tuple[str, Findings]] = {}
    for body, first in maps.items():
        own = [*parts, _UNSAFE.sub("_", first.path.stem)] if len(maps) > 1 else parts
        name = path.with_name(".".join([path.stem, *own]) + path.suffix)
        while name in named:
            name = name.with_name(f"{name.stem}-2{name.suffix}")
        named[name] = body, first
    return named
