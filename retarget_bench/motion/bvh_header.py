"""Reading the text before the numbers: joints, number of frames, frame time."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion.bvh_document import POSITIONS, ROTATIONS, Header, Hierarchy
from retarget_bench.motion.skeleton import EndSite

_CHANNELS = {name.lower(): name for name in (*POSITIONS, *ROTATIONS)}
_END_SITE = -1
_FRAMES = re.compile(r"\s*Frames\s*:\s*(\S+)\s*", re.IGNORECASE)
_FRAME_TIME = re.compile(r"\s*Frame\s+Time\s*:\s*(\S+)\s*", re.IGNORECASE)
_MOST_JOINTS = 20_000
"""More than any body has; it bounds the work on a damaged or hostile file."""

Offset = tuple[float, float, float]


def read_header(path: Path, lines: Sequence[str]) -> Header:
    """The header from its lines, ``HIERARCHY`` to ``Frame Time:``.

    Raises FileError with the line at fault.
    """
    reader = _Reader(path)
    motion = reader.hierarchy(lines)
    after = [(number, text) for number, text in enumerate(lines[motion:], motion + 1) if text.strip()]
    if len(after) < 2:
        raise FileError(path, "ends before the lines 'Frames:' and 'Frame Time:'", len(lines))
    return Header(reader.result(), _frames(path, *after[0]), _frame_time(path, *after[1]))


def _frames(path: Path, number: int, text: str) -> int:
    found = _FRAMES.fullmatch(text)
    if not found or not found[1].isdecimal() or len(found[1]) > 15:
        raise FileError(path, f"expected 'Frames:' and a whole number, found {text.strip()[:60]!r}", number)
    return int(found[1])


def _frame_time(path: Path, number: int, text: str) -> float:
    found = _FRAME_TIME.fullmatch(text)
    seconds = _number(found[1]) if found else None
    if seconds is None or not 1e-6 <= seconds <= 1e4:
        raise FileError(
            path, f"expected 'Frame Time:' and seconds above 0, found {text.strip()[:60]!r}", number
        )
    return seconds


def _number(token: str) -> float | None:
    """A finite number, or None."""
    try:
        value = float(token)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in token else None


@dataclass
class _Block:
    """The braces of one joint or end site (``joint`` is -1) while they are being read."""

    joint: int
    label: str
    parent: int
    line: int
    opened: bool = False
    offset: Offset | None = None


class _Reader:
    """Walks over the lines; ``blocks`` are the joints that are still open, the outermost first."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.line = 0
        self.names: list[str] = []
        self.parents: list[int] = []
        self.offsets: list[Offset] = []
        self.channels: list[tuple[str, ...] | None] = []
        self.end_sites: list[EndSite] = []
        self.blocks: list[_Block] = []
        self.open_names: set[str] = set()

    def hierarchy(self, lines: Sequence[str]) -> int:
        """Read up to the line MOTION; the index of the line after it."""
        for index, line in enumerate(lines):
            self.line = index + 1
            text = line.strip()
            if text.upper() == "MOTION":
                self._finish()
                return index + 1
            self._statements(text)
        raise self._error("ends before the line MOTION" + self._still_open())

    def result(self) -> Hierarchy:
        return Hierarchy(
            names=tuple(self.names),
            parents=np.array(self.parents, dtype=np.int64),
            offsets=np.array(self.offsets, dtype=np.float64).reshape(-1, 3),
            channels=tuple(each or () for each in self.channels),
            end_sites=tuple(self.end_sites),
        )

    # ------------------------------------------------------------------------------------- statements
    def _statements(self, text: str) -> None:
        """One line: mostly one statement, but braces may share it with others."""
        while text:
            if text[0] in "{}":
                (self._open if text[0] == "{" else self._close)()
                text = text[1:].lstrip()
                continue
            end = min((at for at in (text.find("{"), text.find("}")) if at >= 0), default=len(text))
            self._statement(text[:end].rstrip())
            text = text[end:]

    def _statement(self, text: str) -> None:
        words = text.split()
        keyword = words[0].upper()
        if self.blocks and not self.blocks[-1].opened:
            raise self._error(f"expected '{{' after {self.blocks[-1].label}, found {text[:60]!r}")
        if keyword == "OFFSET":
            self._offset(words)
        elif keyword == "CHANNELS":
            self._channel_list(words)
        elif keyword in ("JOINT", "ROOT"):
            self._joint(keyword, text[len(keyword) :].strip())
        elif keyword == "END" and self.blocks:
            self._begin(_Block(_END_SITE, "End Site", self.blocks[-1].joint, self.line))
        elif keyword != "HIERARCHY" or self.names:
            raise self._error(f"{text[:60]!r} is not a line of a BVH hierarchy")

    def _joint(self, keyword: str, name: str) -> None:
        if not name:
            raise self._error(f"{keyword} without a name")
        if keyword == "ROOT" and self.names:
            raise self._error(
                f"a second ROOT {name!r} after {self.names[0]!r}: save each skeleton in a file of its own"
            )
        if keyword == "JOINT" and not self.blocks:
            raise self._error(f"JOINT {name!r} lies outside of the ROOT")
        if name in self.open_names:
            raise self._error(
                f"joint {name!r} lies below a joint of the same name: the hierarchy is cyclic"
            )
        if len(self.names) == _MOST_JOINTS:
            raise self._error(f"more than {_MOST_JOINTS} joints")
        parent = self.blocks[-1].joint if self.blocks else -1
        self._begin(_Block(len(self.names), f"{keyword} {name!r}", parent, self.line))
        self.open_names.add(name)
        self.names.append(name)
        self.parents.append(parent)
        self.channels.append(None)
        self.offsets.append((0.0, 0.0, 0.0))

    def _begin(self, block: _Block) -> None:
        if self.blocks and self.blocks[-1].joint == _END_SITE:
            raise self._error(f"{block.label} lies inside an End Site")
        self.blocks.append(block)

    def _open(self) -> None:
        if not self.blocks or self.blocks[-1].opened:
            raise self._error("'{' without a ROOT, JOINT or End Site before it")
        self.blocks[-1].opened = True

    def _close(self) -> None:
        if not self.blocks or not self.blocks[-1].opened:
            raise self._error("'}' without a '{' before it")
        block = self.blocks.pop()
        if block.offset is None:
            raise self._error(f"{block.label}, begun in line {block.line}, has no OFFSET")
        if block.joint == _END_SITE:
            self.end_sites.append(EndSite(block.parent, block.offset))
        else:
            self.open_names.discard(self.names[block.joint])

    def _offset(self, words: list[str]) -> None:
        numbers = [_number(word) for word in words[1:]]
        x, y, z = numbers if len(numbers) == 3 else (None, None, None)
        if x is None or y is None or z is None:
            raise self._error(f"OFFSET needs three finite numbers, found {' '.join(words[1:])[:60]!r}")
        if not self.blocks or self.blocks[-1].offset is not None:
            raise self._error("OFFSET outside of a joint, or the second one of a joint")
        block = self.blocks[-1]
        block.offset = (x, y, z)
        if block.joint != _END_SITE:
            self.offsets[block.joint] = block.offset

    def _channel_list(self, words: list[str]) -> None:
        joint = self.blocks[-1].joint if self.blocks else _END_SITE
        if joint == _END_SITE or self.channels[joint] is not None:
            raise self._error("CHANNELS outside of a joint, or the second one of a joint")
        given = words[2:]
        if len(words) < 2 or words[1] != str(len(given)):
            raise self._error(
                f"CHANNELS says {words[1] if len(words) > 1 else 'nothing'}, but {len(given)} names follow"
            )
        names = [_CHANNELS.get(word.lower()) for word in given]
        if None in names:
            raise self._error(
                f"channel {given[names.index(None)]!r} is not known; a joint has Xposition, Yposition, "
                "Zposition, Xrotation, Yrotation, Zrotation or fewer"
            )
        if len(set(names)) < len(names):
            raise self._error(f"a channel is named twice: {' '.join(given)[:60]}")
        self.channels[joint] = tuple(name for name in names if name)

    # ----------------------------------------------------------------------------------------- the end
    def _finish(self) -> None:
        if self.blocks:
            raise self._error("MOTION comes before the hierarchy is closed" + self._still_open())
        if not self.names:
            raise self._error("a hierarchy without a ROOT")

    def _still_open(self) -> str:
        if not self.blocks:
            return ""
        return f": {self.blocks[-1].label}, begun in line {self.blocks[-1].line}, has no '}}'"

    def _error(self, problem: str) -> FileError:
        return FileError(self.path, problem, self.line)
