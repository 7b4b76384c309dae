"""Checked look-ups in the JSON of a glTF file: what has the wrong type or lies outside is a FileError."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError

_LARGEST = 1e9
"""No place, turn or scale of a body is larger in any unit."""


class Values:
    """The JSON of a file, with the path for messages."""

    def __init__(self, path: Path, content: dict[str, Any]) -> None:
        self.path, self.content = path, content
        self._items: dict[str, list[dict[str, Any]]] = {}

    def fail(self, problem: str) -> FileError:
        """The error to raise: ``problem`` is the rest of a sentence about the file."""
        return FileError(self.path, problem)

    def items(self, key: str) -> list[dict[str, Any]]:
        """A list of objects at the top level, such as ``nodes``; [] where there is none."""
        if key not in self._items:
            entries = self.content.get(key, [])
            if not isinstance(entries, list) or not all(isinstance(each, dict) for each in entries):
                raise self.fail(f"its {key!r} is no list of objects: the file is damaged")
            self._items[key] = entries
        return self._items[key]

    def item(self, key: str, number: Any, by: str) -> dict[str, Any]:
        """One of these objects; ``by`` names what refers to it."""
        entries = self.items(key)
        if not _is_whole(number) or not 0 <= number < len(entries):
            raise self.fail(f"{by} refers to {key}[{_shown(number)}], and there are {len(entries)}")
        return entries[number]

    def inside(self, owner: dict[str, Any], key: str, by: str) -> dict[str, Any]:
        """An object in another; {} where there is none."""
        value = owner.get(key, {})
        if not isinstance(value, dict):
            raise self.fail(f"{by} has a {key!r} that is no object: the file is damaged")
        return value

    def listed(self, owner: dict[str, Any], key: str, by: str, kind: type = dict) -> list[Any]:
        """A list of objects (or of whole numbers, ``kind=int``) in another; [] where there is none."""
        entries = owner.get(key, [])
        if not isinstance(entries, list):
            raise self.fail(f"{by} has {key!r} that are no list: the file is damaged")
        if not all(_is_whole(each) if kind is int else isinstance(each, kind) for each in entries):
            raise self.fail(f"{by} has {key!r} of the wrong kind: the file is damaged")
        return entries

    def integer(self, owner: dict[str, Any], key: str, by: str, default: int | None = None) -> int:
        """A whole number of at least 0; raises FileError where it is missing and has no default."""
        value = owner.get(key, default)
        if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 53:
            return value
        raise self.fail(f"{by} has {key}={_shown(value)}, which is no count or offset")

    def text(self, owner: dict[str, Any], key: str) -> str:
        """A text; "" where there is none, or something else."""
        value = owner.get(key, "")
        return value if isinstance(value, str) else ""

    def numbers(self, owner: dict[str, Any], key: str, count: int, by: str) -> np.ndarray | None:
        """``(count,)`` finite numbers, None where there are none."""
        value = owner.get(key)
        if value is None:
            return None
        if not isinstance(value, list) or len(value) != count or not all(map(_is_finite, value)):
            raise self.fail(f"{by} has a {key!r} that is not {count} finite numbers")
        return np.array(value, dtype=np.float64)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite(value: Any) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and abs(value) <= _LARGEST and math.isfinite(value)


def _shown(value: Any) -> str:
    text = (
        "nothing" if value is None else repr(value) if isinstance(value, float | str) else str(value)[:20]
    )
    return text[:40]
