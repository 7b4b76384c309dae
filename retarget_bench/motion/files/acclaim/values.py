"""The numbers of an AMC file, by bone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion.files.acclaim.text import Line, content, numbers

_NUMERIC = b"0123456789+-.eE"
_LONGEST = 1e9


@dataclass(frozen=True, eq=False)
class AcclaimMotion:
    """values: bone -> ``(frames, numbers)``, in the order of its degrees of freedom; radians: of one unit
    of angles, None where the file does not say."""

    values: Mapping[str, np.ndarray]
    frames: int
    radians: float | None


def read_values(path: Path, widths: Mapping[str, int], skeleton: Path) -> AcclaimMotion:
    """The motion of bones with so many degrees of freedom each (``widths``, in ``skeleton``).

    All frames name the same bones. A file whose frames are written alike is cut into words and converted
    as a whole. Raises FileError, with its line, for frames that are not so.
    """
    data = content(path, "AMC")
    start, line, radians = _head(path, data)
    words = data[start:].split()
    if not words:
        raise FileError(path, "has no frames: there is no motion in it", line)
    values = _alike(words, widths)
    if values is None:
        values = _by_lines(path, data[start:], widths, skeleton, line)
    return AcclaimMotion(values, len(next(iter(values.values()))), radians)


def _head(path: Path, data: bytes) -> tuple[int, int, float | None]:
    """The offset and line at which frames begin, and the unit of angles."""
    start, number, radians = 0, 1, None
    while start < len(data):
        stop = data.find(b"\n", start)
        stop = len(data) if stop < 0 else stop
        text = data[start:stop].strip()
        keyword = text.upper()
        if keyword in (b":DEGREES", b":RADIANS"):
            radians = 1.0 if keyword == b":RADIANS" else math.radians(1.0)
        elif text and not text.startswith((b"#", b":")):
            if text.isdigit():
                return start, number, radians
            shown = text[:40].decode("utf-8", "replace")
            raise FileError(path, f"expected the number of the first frame, found {shown!r}", number)
        start, number = stop + 1, number + 1
    raise FileError(path, "has no frames: there is no motion in it", max(number - 1, 1))


def _alike(words: Sequence[bytes], widths: Mapping[str, int]) -> dict[str, np.ndarray] | None:
    """The numbers where every frame names the same bones in the same order; None where that is not sure."""
    order, size = list[tuple[str, int]](), 1
    while size < len(words) and not _is_number(words[size]):
        name = words[size].decode("utf-8", "replace").lower()
        if name not in widths or any(name == each for each, _ in order):
            return None
        order.append((name, size))
        size += 1 + widths[name]
    if not order or len(words) % size:
        return None
    frames = len(words) // size
    by_bone = {}
    if not all(word.isdigit() for word in words[::size]):
        return None
    for name, place in order:
        if words[place::size].count(words[place]) != frames:
            return None
        columns = [words[n::size] for n in range(place + 1, place + 1 + widths[name])]
        values = [_floats(column) for column in columns]
        if any(each is None for each in values):
            return None
        by_bone[name] = np.array(values, dtype=np.float64).reshape(widths[name], frames).T
    return by_bone


def _is_number(word: bytes) -> bool:
    return not word.translate(None, _NUMERIC) and any(48 <= byte < 58 for byte in word)


def _floats(words: Sequence[bytes]) -> list[float] | None:
    try:
        values = list(map(float, words))
    except ValueError:
        return None
    # what float() takes beside plain numbers: nan, inf, 1_000
    plain = not b"".join(words).translate(None, _NUMERIC)
    return values if plain and max(map(abs, values)) <= _LONGEST else None


def _by_lines(
    path: Path, block: bytes, widths: Mapping[str, int], skeleton: Path, first: int
) -> dict[str, np.ndarray]:
    """The slow way, for files with a fault, which it finds, and frames that are written in other orders."""
    frames: list[dict[str, list[float]]] = []
    started = first
    for number, text in enumerate(block.decode("utf-8", "replace").split("\n"), first):
        words = text.split()
        if not words or words[0].startswith("#"):
            continue
        line = Line(path, number, words)
        if len(words) == 1 and words[0].isdigit():
            if frames:
                _check_last(line, frames, started)
            frames.append({})
            started = number
            continue
        name = words[0].lower()
        if name not in widths:
            raise line.fault(f"{words[0][:40]!r} is no bone of {skeleton.name} that can move")
        if name in frames[-1]:
            raise line.fault(f"{name!r} stands twice in frame {len(frames)}")
        frames[-1][name] = numbers(line, words[1:], widths[name])
    _check_last(Line(path, first + block.count(b"\n"), []), frames, started)
    return {name: np.array([frame[name] for frame in frames]) for name in frames[0]}


def _check_last(line: Line, frames: Sequence[Mapping[str, list[float]]], started: int) -> None:
    """Raises FileError where the last frame names other bones than the first."""
    if not frames[-1]:
        raise FileError(line.path, f"frame {len(frames)} is empty", started)
    if missing := [name for name in frames[0] if name not in frames[-1]]:
        more = f" and {len(missing) - 1} more bones" if len(missing) > 1 else ""
        raise FileError(
            line.path,
            f"frame {len(frames)} lacks {missing[0]!r}{more}: the file is cut off or damaged",
            started,
        )
    if extra := [name for name in frames[-1] if name not in frames[0]]:
        raise FileError(line.path, f"frame {len(frames)} has {extra[0]!r}, which frame 1 lacks", started)
