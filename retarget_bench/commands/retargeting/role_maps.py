"""Maps of joints to roles as files that ``--roles`` and ``--target-roles`` read."""

from __future__ import annotations

import hashlib
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


def save(
    path: Path, sources: Sequence[Findings], targets: Sequence[Findings], overwrite: bool = False
) -> list[str]:
    """Write the maps of sources to ``path``, and those of targets beside it with ``.target`` before the
    ending; where bodies of a side differ, one file for each, with the name of the first motion of it.

    Files that are there are replaced where this wrote them for motions of the same names and nobody has
    changed them since; others with ``overwrite`` alone. Returns a line for each file. Raises BenchError,
    and has then written none.
    """
    if path.suffix.lower() != ".toml":
        raise BenchError(f"{path}: role maps are TOML files; end the name in .toml")
    files: dict[Path, str] = {}
    lines = []
    for side, found in (("", sources), ("target", targets)):
        for name, (body, first) in _named(path, side, found).items():
            option = f"--{side}-roles" if side else "--roles"
            head = f"# joints of {first.path.name}; read by {option}"
            if not overwrite and not _may_replace(name, head):
                raise BenchError(
                    f"--save-map would overwrite {name}, which was changed since or is not of "
                    f"{first.path.name}; choose another name, or say --overwrite"
                )
            files[name] = f"{head}; written as {_digest(body)}\n{body}"
            lines.append(f"{name}: what joints are, for {option}")
    for name, content in files.items():
        write_text(name, content)
    return lines


def _digest(body: str) -> str:
    """By which a map that somebody has corrected is known."""
    return hashlib.sha256(body.encode("utf-8", "surrogatepass")).hexdigest()[:12]


def _may_replace(path: Path, head: str) -> bool:
    """Whether there is no file, or one that was written under this heading and is as it was."""
    try:
        first, _, body = path.read_text(encoding="utf-8").partition("\n")
    except FileNotFoundError:
        return True
    except (OSError, ValueError):
        return False
    return first == f"{head}; written as {_digest(body)}"


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
